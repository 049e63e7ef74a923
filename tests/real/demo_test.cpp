// SPDX-License-Identifier: Apache-2.0
//
// README's demo, run whole: zig-zags, training, and the plugin in the running 1 kHz loop. Its
// figures must reach the paper's reductions (arXiv 2302.04999 and T-ASE 2025): 85 % against raw
// unloaded and 79 % with 500 g, 62 % against bias removal.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

fs::path run_demo() {
  const fs::path out = fs::temp_directory_path() / "ravencal_demo_test";
  fs::remove_all(out);
  const std::string command =
      fmt::format("cd '{}' && PATH='{}:{}':\"$PATH\" tools/demo.sh --plugin '{}' --out '{}'",
                  RAVENCAL_SOURCE_DIR, RAVENCAL_PROGRAM_DIR, RAVENCAL_DRIVER_DIR, RAVENCAL_PLUGIN,
                  out.string());
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  return out;
}

Json figures(const fs::path& file) {
  std::ifstream stream(file);
  return Json::parse(stream, nullptr, false);
}

double fall(const Json& joint, const char* from) {
  return 1.0 - joint["calibrated"]["rmse"].get<double>() / joint[from]["rmse"].get<double>();
}

void expect_reductions(const Json& result, double against_raw, double against_bias) {
  ASSERT_TRUE(result.contains("joints")) << result.dump();
  ASSERT_EQ(result["joints"].size(), 3U);
  for (const Json& joint : result["joints"]) {
    EXPECT_GE(fall(joint, "raw"), against_raw) << joint.dump();
    EXPECT_GE(fall(joint, "bias_removed"), against_bias) << joint.dump();
  }
}

TEST(Demo, ReachesThePapersReductionsOnUnseenMotionAndInTheRunningLoop) {
  const fs::path out = run_demo();
  expect_reductions(figures(out / "evaluate_0g.json"), 0.85, 0.62);
  expect_reductions(figures(out / "evaluate_500g.json"), 0.79, 0.62);
  for (const char* name : {"host_0g.json", "host_500g.json"}) {
    const Json result = figures(out / name);
    expect_reductions(result, 0.79, 0.0);
    EXPECT_EQ(result["rate_hz"].get<double>(), 1000.0);
    EXPECT_TRUE(result.contains("realtime"));
  }
  for (const char* name : {"report_0g.html", "report_500g.html"}) {
    EXPECT_GT(fs::file_size(out / name), 100'000U) << name;
  }
}

}  // namespace
