// SPDX-License-Identifier: Apache-2.0
//
// README's demo, run whole: zig-zags, training, the plugin in the running 1 kHz loop; then an
// effect is hidden in a plant and found again. Its figures must reach the paper's reductions (arXiv
// 2302.04999 and T-ASE 2025): 85 % against raw unloaded and 79 % with 500 g, 62 % against bias
// removal; of ten hidden effects at least nine must be found, at most one in seven beside a false
// name.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

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

void expect_reductions(const Json& result, double against_raw, double against_bias) {
  ASSERT_TRUE(result.contains("joints")) << result.dump();
  ASSERT_EQ(result["joints"].size(), 3U);
  for (const Json& joint : result["joints"]) {
    EXPECT_GE(fall(joint, "raw"), against_raw) << joint.dump();
    EXPECT_GE(fall(joint, "bias_removed"), against_bias) << joint.dump();
  }
}

TEST(Demo, ReachesThePapersReductionsAndEndsWithBothTablesAndThePages) {
  const fs::path out = folder("demo");
  const auto demo = run_demo(out, "--seed 1");
  ASSERT_EQ(demo.exit_code, 0) << demo.text;
  expect_reductions(figures(out / "evaluate_0g.json"), 0.85, 0.62);
  expect_reductions(figures(out / "evaluate_500g.json"), 0.79, 0.62);
  for (const char* name : {"host_0g.json", "host_500g.json"}) {
    const Json result = figures(out / name);
    expect_reductions(result, 0.79, 0.0);
    EXPECT_EQ(result["rate_hz"].get<double>(), 1000.0);
    EXPECT_TRUE(result.contains("realtime"));
  }
  std::size_t last = demo.text.find("[", demo.text.find("act two, diagnose"));
  for (const char* words :
       {"act one, unloaded", "act one, 500 g", "act two, seed 1", "hidden ", "found ",
        "pages:", "report_0g.html", "report_500g.html", "diagnosis/report.html"}) {
    const std::size_t at = demo.text.find(words, last);
    ASSERT_NE(at, std::string::npos) << words << " in its place in:\n" << demo.text;
    last = at;
  }
  for (const char* name : {"report_0g.html", "report_500g.html", "diagnosis/report.html"}) {
    EXPECT_GT(fs::file_size(out / name), 100'000U) << name;
  }
}

/// What the second act came to with each of the seeds; on all cores.
std::vector<Json> hidden_effects(const std::vector<int>& seeds) {
  std::vector<Json> revealed(seeds.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < seeds.size(); i = next++) {
      const fs::path out = folder(fmt::format("hidden_{}", seeds[i]));
      (void)run_demo(out, fmt::format("--act diagnose --seed {}", seeds[i]));
      revealed[i] = figures(out / "revealed.json");
      fs::remove_all(out);
    }
  };
  std::vector<std::thread> workers;
  for (unsigned n = std::max(1U, std::thread::hardware_concurrency()); n > 0; --n)
    workers.emplace_back(work);
  for (std::thread& worker : workers) worker.join();
  return revealed;
}

/// A third of the seeds, always the same; all twenty of them where RAVENCAL_LONG is set.
TEST(Demo, FindsNineOfTenHiddenEffectsAndSeldomNamesMore) {
  std::vector<int> seeds;
  for (int seed = 1; seed <= 20; seed += std::getenv("RAVENCAL_LONG") != nullptr ? 1 : 3)
    seeds.push_back(seed);
  std::size_t found = 0, beside = 0;
  std::string others;
  for (const Json& one : hidden_effects(seeds)) {
    const std::string outcome = one.is_object() ? one.value("outcome", "") : "";
    beside += outcome == "found_beside_false_names" ? 1 : 0;
    found += outcome == "found" || outcome == "found_beside_false_names" ? 1 : 0;
    if (outcome != "found") others += one.dump() + "\n";
  }
  EXPECT_GE(10 * found, 9 * seeds.size()) << others;
  EXPECT_LE(7 * beside, seeds.size()) << others;
}

}  // namespace
