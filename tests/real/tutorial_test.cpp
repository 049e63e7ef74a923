// SPDX-License-Identifier: Apache-2.0
//
// The commands of tools/diagnose/TUTORIAL.md, as a reader pastes them, on real recordings.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "unit/run_command.hpp"

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;

std::string tutorial_script() {
  std::ifstream file(RAVENCAL_SOURCE_DIR "/tools/diagnose/TUTORIAL.md");
  std::string script;
  bool inside = false;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("```"))
      inside = line == "```sh test";
    else if (inside)
      script += line + "\n";
  }
  return script;
}

struct Named {
  std::string joint, id;
  double value = 0.0;
};

std::vector<Named> named_in(const fs::path& folder) {
  const auto report = nlohmann::json::parse(std::ifstream(folder / "report.json"));
  std::vector<Named> out;
  for (const auto& effect : report.at("effects"))
    out.push_back({effect.at("joint"), effect.at("id"), effect.at("parameters").at(0).at("value")});
  return out;
}

const Named* find(const std::vector<Named>& all, const std::string& joint, const std::string& id) {
  const auto at = std::find_if(all.begin(), all.end(),
                               [&](const Named& n) { return n.joint == joint && n.id == id; });
  return at == all.end() ? nullptr : &*at;
}

TEST(DiagnoseTutorial, DoesWhatItSays) {
  const fs::path data = RAVENCAL_DATA_DIR;
  if (!fs::exists(data / "double_pendulum") || !fs::exists(data / "so101"))
    GTEST_SKIP() << "no recordings in " << data << "; set RAVENCAL_DATA_DIR";
  if (run_command("/usr/bin/python3 -c 'import numpy' 2>&1").exit_code != 0)
    GTEST_SKIP() << "python3-numpy is not installed";
  const fs::path folder = fs::path(::testing::TempDir()) / "ravencal_diagnose_tutorial";
  fs::remove_all(folder);
  fs::create_directories(folder);
  const std::string script = tutorial_script();
  ASSERT_NE(script.find("ravencal profile guess"), std::string::npos);
  std::ofstream(folder / "tutorial.sh")
      << "set -eu\nPATH=" << fs::path(RAVENCAL_PROGRAM).parent_path().string()
      << ":$PATH\ndata=" << data.string() << "\nplants=" RAVENCAL_SOURCE_DIR "/tools/plants\n"
      << script;
  const Outcome outcome =
      run_command(fmt::format("cd '{}' && timeout 1800 bash tutorial.sh 2>&1", folder.string()));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.text;

  // 0.123 N m was published.
  for (const char* made : {"pendulum", "other_simulator"}) {
    const std::vector<Named> found = named_in(folder / made);
    const Named* friction = find(found, "elbow", "coulomb_friction");
    ASSERT_NE(friction, nullptr) << made;
    EXPECT_NEAR(friction->value, 0.123, 0.03) << made;
  }
  EXPECT_NE(outcome.text.find("<joint name=\"elbow\""), std::string::npos);
  for (const char* made : {"so101", "forward"}) {
    const std::vector<Named> found = named_in(folder / made);
    for (const char* joint :
         {"shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll"}) {
      const Named* delay = find(found, joint, "delay");
      ASSERT_NE(delay, nullptr) << made << " " << joint;
      EXPECT_NEAR(delay->value, 0.11, 0.06) << made << " " << joint;
    }
  }
  const std::vector<Named> by_command = named_in(folder / "by_command");
  EXPECT_NE(find(by_command, "elbow", "coulomb_friction"), nullptr);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace ravencal::test
