// SPDX-License-Identifier: Apache-2.0
//
// README's demo, run whole: zig-zags, training, the plugin in the running 1 kHz loop; then an
// effect is hidden in a robot and looked for. The figures of calibration must reach the paper's
// reductions (arXiv 2302.04999 and T-ASE 2025): 85 % against raw unloaded and 79 % with 500 g, 62 %
// against bias removal. After a homing apart from the training, shoulder and insertion miss the
// last one unloaded, as README says; they must stay where they are.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "unit/run_command.hpp"

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// Of this process alone.
fs::path folder(const std::string& name) {
  return fs::temp_directory_path() / fmt::format("ravencal_{}_{}", name, ::getpid());
}

ravencal::test::Outcome run_demo(const fs::path& out, const std::string& arguments) {
  fs::remove_all(out);
  return ravencal::test::run_command(fmt::format(
      "cd '{}' && PATH='{}:{}':\"$PATH\" tools/demo.sh --plugin '{}' --out '{}' {} 2>&1",
      RAVENCAL_SOURCE_DIR, RAVENCAL_PROGRAM_DIR, RAVENCAL_DRIVER_DIR, RAVENCAL_PLUGIN, out.string(),
      arguments));
}

Json figures(const fs::path& file) {
  std::ifstream stream(file);
  return Json::parse(stream, nullptr, false);
}

double fall(const Json& joint, const char* from) {
  return 1.0 - joint["calibrated"]["rmse"].get<double>() / joint[from]["rmse"].get<double>();
}

/// `against_bias`: of shoulder, elbow and insertion.
void expect_reductions(const Json& result, double against_raw,
                       const std::array<double, 3>& against_bias) {
  ASSERT_TRUE(result.contains("joints")) << result.dump();
  ASSERT_EQ(result["joints"].size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    const Json& joint = result["joints"][i];
    EXPECT_GE(fall(joint, "raw"), against_raw) << joint.dump();
    EXPECT_GE(fall(joint, "bias_removed"), against_bias[i]) << joint.dump();
  }
}

TEST(Demo, ReachesThePapersReductionsAndEndsWithBothTablesAndThePages) {
  const fs::path out = folder("demo");
  const auto demo = run_demo(out, "--seed 1");
  ASSERT_EQ(demo.exit_code, 0) << demo.text;
  expect_reductions(figures(out / "evaluate_0g.json"), 0.85, {0.60, 0.62, 0.44});
  expect_reductions(figures(out / "evaluate_500g.json"), 0.79, {0.62, 0.62, 0.62});
  for (const char* name : {"evaluate_0g.json", "evaluate_500g.json"}) {
    for (const char* shared : {"same_seed", "one_homing"})
      EXPECT_FALSE(figures(out / name).contains(shared)) << name;
  }
  for (const char* name : {"host_0g.json", "host_500g.json"}) {
    const Json result = figures(out / name);
    expect_reductions(result, 0.79, {0.0, 0.0, 0.0});
    EXPECT_EQ(result["rate_hz"].get<double>(), 1000.0);
    EXPECT_TRUE(result.contains("realtime"));
  }
  std::size_t last = demo.text.find("[", demo.text.find("act two, diagnose"));
  for (const char* words :
       {"act one, unloaded", "act one, 500 g", "act two, seed 1", "hidden ", "found ",
        "pages:", "report_0g.html", "report_500g.html", "one/diagnosis/report.html"}) {
    const std::size_t at = demo.text.find(words, last);
    ASSERT_NE(at, std::string::npos) << words << " in its place in:\n" << demo.text;
    last = at;
  }
  for (const char* name : {"report_0g.html", "report_500g.html", "one/diagnosis/report.html"}) {
    EXPECT_GT(fs::file_size(out / name), 100'000U) << name;
  }
}

/// Whether an effect is found is the proof's affair; that the demo says so, and the same again, is
/// this one's.
TEST(Demo, SaysWhatItHidAndFoundAndTheSameForTheSameSeed) {
  const fs::path first = folder("hidden_first"), second = folder("hidden_second");
  std::string texts[2];
  for (const auto& [i, out] : {std::pair{0, first}, {1, second}}) {
    const auto demo = run_demo(out, "--act diagnose --seed 2");
    ASSERT_EQ(demo.exit_code, 0) << demo.text;
    EXPECT_NE(demo.text.find("one/diagnosis/report.html"), std::string::npos) << demo.text;
    texts[i] = demo.text.substr(demo.text.find("\nhidden "));
    texts[i].erase(texts[i].find("report: "));
  }
  EXPECT_EQ(texts[0], texts[1]);
  EXPECT_EQ(std::count(texts[0].begin(), texts[0].end(), '\n'), 4) << texts[0];
  EXPECT_NE(texts[0].find("\nfound "), std::string::npos) << texts[0];
  EXPECT_EQ(figures(first / "one/one.json"), figures(second / "one/one.json"));
  EXPECT_GT(fs::file_size(first / "one/diagnosis/report.html"), 100'000U);
  fs::remove_all(first);
  fs::remove_all(second);
}

}  // namespace
