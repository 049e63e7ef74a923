// SPDX-License-Identifier: Apache-2.0
//
// The house rules that a reader relies on: which room may include which, and how long a file gets.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

const fs::path kRoot = RAVENCAL_SOURCE_DIR;

// Rooms by the first word of an include path, and what each may include. Arrows point left:
// core <- model, record, physics <- programs; the plugin sees core and model only.
const std::map<std::string, std::set<std::string>> kMayInclude = {
    {"shared/core", {"core"}},
    {"shared/record", {"core", "record"}},
    {"shared/model", {"core", "record", "model"}},
    {"shared/physics", {"core", "physics"}},
    {"rt_plugin", {"core", "model", "ravencal", "rt_plugin", "kernels", "plugin"}},
    {"tools/cli", {"core", "cli"}},
    {"tools/learn", {"core", "record", "model", "learn", "report", "cli"}},
    {"tools/report", {"core", "report"}},
};

std::vector<fs::path> sources_below(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
    const auto extension = entry.path().extension();
    if (extension == ".cpp" || extension == ".hpp" || extension == ".h") files.push_back(entry.path());
  }
  return files;
}

std::vector<std::string> included_rooms(const fs::path& file) {
  static const std::regex include(R"re(^#include "([a-z0-9_]+)/)re");
  std::ifstream stream(file);
  std::vector<std::string> rooms;
  for (std::string line; std::getline(stream, line);) {
    std::smatch match;
    if (std::regex_search(line, match, include)) rooms.push_back(match[1]);
  }
  return rooms;
}

TEST(Architecture, IncludesPointOneWay) {
  for (const auto& [room, allowed] : kMayInclude) {
    const auto files = sources_below(room);
    EXPECT_FALSE(files.empty()) << room;
    for (const auto& file : files) {
      for (const auto& target : included_rooms(file)) {
        EXPECT_TRUE(allowed.contains(target)) << file << " includes " << target;
      }
    }
  }
}

TEST(Architecture, NothingOutsideThePluginIncludesItsInside) {
  for (const char* folder : {"shared", "quadrature_reader", "tools"}) {
    for (const auto& file : sources_below(folder)) {
      for (const auto& target : included_rooms(file)) {
        EXPECT_TRUE(target != "rt_plugin") << file;
      }
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
