// SPDX-License-Identifier: Apache-2.0
//
// Rules of the source tree: which folder may include which, and how long a file may be.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace {

namespace fs = std::filesystem;

const fs::path kRoot = RAVENCAL_SOURCE_DIR;

// Each module and what its files may include, by the first word of an include path. Arrows point
// left: core <- record <- model and core <- physics, then the programs. The plugin sees core and
// model only; of the plugin, others see its C header (ravencal/) only, and `convert` tries the
// kernels. A file belongs to the innermost module that holds it.
const std::map<std::string, std::set<std::string>> kMayInclude = {
    {"shared/core", {"core"}},
    {"shared/record", {"core", "record"}},
    {"shared/model", {"core", "record", "model"}},
    {"shared/physics", {"core", "physics"}},
    {"rt_plugin", {"core", "model", "ravencal", "rt_plugin"}},
    {"rt_plugin/integration", {"ravencal"}},
    {"rt_plugin/kernels", {"model", "kernels"}},
    {"quadrature_reader", {"core", "record", "cli", "quadrature_reader"}},
    {"tools", {"core", "cli", "commands"}},
    {"tools/cli", {"core", "cli"}},
    {"tools/commands",
     {"choice",   "cli",        "commands",    "control",    "conversion", "core",      "diagnose",
      "exchange", "experiment", "guess",       "host",       "learn",      "loop",      "model",
      "monitor",  "physics",    "plugin_host", "prove",      "record",     "report",    "rezero",
      "robot",    "shadow",     "signing",     "simulation", "study",      "trajectory"}},
    {"tools/deployment/conversion",
     {"core", "record", "model", "physics", "kernels", "exchange", "learn", "loop", "conversion"}},
    {"tools/diagnose", {"core", "record", "physics", "report", "diagnose"}},
    {"tools/experiment",
     {"core", "record", "physics", "simulation", "trajectory", "diagnose", "experiment"}},
    {"tools/recording/exchange", {"core", "record", "exchange"}},
    {"tools/recording/guess", {"core", "record", "guess"}},
    {"tools/deployment/host",
     {"core", "record", "model", "physics", "learn", "trajectory", "ravencal", "plugin_host",
      "host"}},
    {"tools/deployment/loop", {"core", "record", "model", "physics", "loop"}},
    {"tools/calibration/learn", {"core", "record", "model", "report", "learn"}},
    {"tools/calibration/choice", {"core", "record", "model", "learn", "choice"}},
    {"tools/calibration/methods",
     {"core", "record", "model", "physics", "learn", "choice", "methods"}},
    {"tools/deployment/monitor", {"core", "record", "ravencal", "plugin_host", "monitor"}},
    {"tools/deployment/rezero",
     {"core", "cli", "record", "model", "learn", "ravencal", "monitor", "control", "rezero"}},
    {"tools/deployment/control", {"core", "ravencal", "monitor", "control"}},
    {"tools/deployment/shadow", {"core", "record", "ravencal", "plugin_host", "shadow"}},
    // What Python sees of the libraries.
    {"tools/python",
     {"core", "record", "model", "physics", "exchange", "guess", "simulation", "trajectory",
      "learn", "choice", "diagnose", "python"}},
    {"tools/plugin_host", {"core", "model", "ravencal", "plugin_host"}},
    // The proof is not graded by its own author: the generator sees no physics but its own.
    {"tools/prove", {"core", "record", "report", "prove"}},
    {"tools/prove/generator", {"core", "record", "prove"}},
    {"tools/report", {"core", "report"}},
    {"tools/recording/robot",
     {"core", "record", "physics", "quadrature_reader", "trajectory", "ravencal", "plugin_host",
      "robot"}},
    {"tools/recording/ros", {"core", "cli", "record", "physics", "robot", "ros"}},
    {"tools/deployment/signing", {"core", "model", "signing"}},
    {"tools/recording/simulation",
     {"core", "record", "physics", "quadrature_reader", "trajectory", "simulation"}},
    {"tools/calibration/study",
     {"core", "record", "exchange", "model", "learn", "methods", "report", "study"}},
    {"tools/recording/trajectory", {"core", "physics", "trajectory"}},
};
constexpr std::array kProduct = {"shared", "rt_plugin", "quadrature_reader", "tools"};

std::vector<fs::path> sources_below(const fs::path& folder) {
  static const std::set<std::string> endings = {".cpp", ".hpp", ".h", ".inc"};
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
    if (endings.contains(entry.path().extension())) files.push_back(entry.path());
  }
  return files;
}

std::vector<std::string> included_modules(const fs::path& file) {
  static const std::regex include(R"re(^#include "([a-z0-9_]+)/)re");
  std::ifstream stream(file);
  std::vector<std::string> modules;
  for (std::string line; std::getline(stream, line);) {
    std::smatch match;
    if (std::regex_search(line, match, include)) modules.push_back(match[1]);
  }
  return modules;
}

/// The innermost module that holds the file; empty if there is none.
std::string module_of(const fs::path& file) {
  fs::path folder = file.parent_path().lexically_relative(kRoot);
  while (!folder.empty() && !kMayInclude.contains(folder.string())) folder = folder.parent_path();
  return folder.string();
}

TEST(Architecture, IncludesPointOneWay) {
  std::set<std::string> seen;
  for (const char* part : kProduct) {
    for (const fs::path& file : sources_below(part)) {
      const std::string module = module_of(file);
      ASSERT_FALSE(module.empty()) << file << " is in no module of this test's table";
      seen.insert(module);
      for (const std::string& target : included_modules(file)) {
        EXPECT_TRUE(kMayInclude.at(module).contains(target)) << file << " includes " << target;
      }
    }
  }
  EXPECT_EQ(seen.size(), kMayInclude.size()) << "a module of the table has no files";
}

/// The way of a recording through the diagnosis: each module sees itself and those before it.
TEST(Architecture, TheModulesOfDiagnoseFollowTheSample) {
  const std::vector<std::string> modules = {"findings", "track",   "model", "vocabulary",
                                            "search",   "explain", "report"};
  const fs::path folder = kRoot / "tools/diagnose";
  const auto place = [&](const std::string& module) {
    return std::find(modules.begin(), modules.end(), module) - modules.begin();
  };
  static const std::regex include(R"re(^#include "diagnose/(?:([a-z_]+)/)?[a-z_]+\.hpp")re");
  for (const fs::path& file : sources_below("tools/diagnose")) {
    const std::string own =
        file.parent_path() == folder ? "" : file.parent_path().filename().string();
    std::ifstream stream(file);
    for (std::string line; std::getline(stream, line);) {
      std::smatch match;
      if (!std::regex_search(line, match, include)) continue;
      EXPECT_LE(place(match[1]), place(own)) << file << ": " << line;
    }
    EXPECT_TRUE(own.empty() || place(own) < static_cast<std::ptrdiff_t>(modules.size())) << file;
  }
}

/// What an effect is stands in tables; neither diagnose nor its blind trials compare ids.
TEST(Architecture, NoModuleOfDiagnoseOrOfItsTrialsComparesIds) {
  static const std::regex row(R"re(^ *\{(?:\.id = |\{)"([a-z_]+)")re");
  static const std::regex compared(R"re([=!]= "([a-z_]+)")re");
  std::set<std::string> ids;
  const auto each_match = [](const fs::path& file, const std::regex& pattern, const auto& found) {
    std::ifstream stream(file);
    for (std::string line; std::getline(stream, line);) {
      std::smatch match;
      if (std::regex_search(line, match, pattern)) found(match[1], line);
    }
  };
  const auto add = [&ids](const std::string& id, const std::string&) { ids.insert(id); };
  each_match(kRoot / "tools/diagnose/findings/effect_words.cpp", row, add);
  EXPECT_GE(ids.size(), 30U);
  const std::size_t named = ids.size();
  for (const fs::path& file : sources_below("tools/prove/generator/kinds"))
    each_match(file, row, add);
  EXPECT_GE(ids.size(), named + 7);  // those from outside of the vocabulary
  for (const char* module : {"tools/diagnose", "tools/prove"}) {
    for (const fs::path& file : sources_below(module)) {
      each_match(file, compared, [&](const std::string& id, const std::string& line) {
        EXPECT_FALSE(ids.contains(id)) << file << ": " << line;
      });
    }
  }
}

std::string text_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

/// Tests that hold a promise of diagnose see it as its callers do, and outlive its inside.
TEST(Architecture, TestsOfPromisesKnowNoInsideOfDiagnose) {
  static const std::regex program(R"re(ravencal_test\(([^)]*)\))re");
  static const std::regex source(R"re(/(\w+\.cpp))re");
  static const std::regex inside(
      R"re(#include "diagnose/(?!diagnose\.hpp|findings/|report/)[^"]*")re");
  int sources = 0;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / "tests")) {
    if (entry.path().extension() != ".cmake") continue;
    const std::string list = text_of(entry.path());
    for (std::sregex_iterator it(list.begin(), list.end(), program), end; it != end; ++it) {
      const std::string test = (*it)[1];
      if (test.find(" promise") == std::string::npos) continue;
      for (std::sregex_iterator file(test.begin(), test.end(), source); file != end; ++file) {
        const std::string text = text_of(entry.path().parent_path() / (*file)[1].str());
        ASSERT_FALSE(text.empty()) << (*file)[1];
        std::smatch match;
        EXPECT_FALSE(std::regex_search(text, match, inside)) << (*file)[1] << ": " << match[0];
        ++sources;
      }
    }
  }
  EXPECT_GT(sources, 15);
}

TEST(Architecture, NothingOutsideThePluginIncludesItsInside) {
  for (const char* part : kProduct) {
    if (std::string_view(part) == "rt_plugin") continue;
    for (const fs::path& file : sources_below(part)) {
      for (const std::string& target : included_modules(file)) {
        EXPECT_NE(target, "rt_plugin") << file;
        EXPECT_TRUE(target != "kernels" || module_of(file) == "tools/deployment/conversion")
            << file;
      }
    }
  }
}

TEST(Architecture, TheProofLinksNothingThatItJudges) {
  std::ifstream stream(kRoot / "tools/prove/CMakeLists.txt");
  ASSERT_TRUE(stream.good());
  for (std::string line; std::getline(stream, line);) {
    if (line.starts_with("#")) continue;
    for (const char* judged : {"physics", "diagnose", "simulation", "trajectory", "ravencal_host"})
      EXPECT_EQ(line.find(judged), std::string::npos) << line;
  }
}

/// A release knows no assert: where one guards a size or an index, users run without it.
TEST(Architecture, ChecksHoldInEveryBuild) {
  static const std::regex asserts(
      R"re((^|[^_a-zA-Z])(eigen_)?assert\s*\(|<cassert>|<assert\.h>)re");
  for (const char* part : {"shared", "tools"}) {
    for (const fs::path& file : sources_below(part)) {
      std::ifstream stream(file);
      for (std::string line; std::getline(stream, line);) {
        EXPECT_FALSE(std::regex_search(line, asserts))
            << file << ": " << line << "\nuse core/require.hpp, or a type that cannot be wrong";
      }
    }
  }
}

/// Other ways throw, end the process, or pass on what a name orders a terminal to do.
TEST(Architecture, WhatProgramsSayGoesThroughCoreTerminal) {
  static const std::regex comment("//.*");
  static const std::regex others(
      R"re(fmt::print|std::(cout|cerr|clog|puts|fputs|printf|perror)\b|\b(stdout|stderr)\b)re");
  for (const char* part : kProduct) {
    for (const fs::path& file : sources_below(part)) {
      std::ifstream stream(file);
      for (std::string line; std::getline(stream, line);)
        EXPECT_FALSE(std::regex_search(std::regex_replace(line, comment, ""), others))
            << file << ": " << line;
    }
  }
}

TEST(Architecture, FilesStaySmallEnoughToReadInOneSitting) {
  constexpr int kLongestFile = 400;
  for (const char* folder : {"shared", "rt_plugin", "quadrature_reader", "tools", "tests"}) {
    for (const auto& file : sources_below(folder)) {
      std::ifstream stream(file);
      int lines = 0;
      for (std::string line; std::getline(stream, line);) ++lines;
      EXPECT_LE(lines, kLongestFile) << file;
    }
  }
}

}  // namespace
