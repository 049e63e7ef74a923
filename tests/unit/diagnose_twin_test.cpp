// SPDX-License-Identifier: Apache-2.0
//
// `ravencal diagnose` beside `trajectory` and `simulate`, as a user types them one after the other.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>

#include "unit/run_command.hpp"

namespace {

namespace fs = std::filesystem;
using namespace ravencal;
using nlohmann::json;
using test::Outcome;

class DiagnoseTwin : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] Outcome run(const std::string& arguments, const std::string& limits = "") const {
    return test::run_command(fmt::format("cd {} && {} {} {} 2>&1", folder_.string(), limits,
                                         RAVENCAL_PROGRAM, arguments));
  }
  void make(const std::string& arguments) const {
    const Outcome made = run(arguments + " --force");
    ASSERT_EQ(made.exit_code, 0) << arguments << "\n" << made.text;
  }
  static std::string plant(const std::string& name) {
    return fmt::format("{}/tools/plants/{}.toml", RAVENCAL_SOURCE_DIR, name);
  }
  static std::string profile(const std::string& name) {
    return fmt::format("{}/tools/profiles/{}.toml", RAVENCAL_SOURCE_DIR, name);
  }
  [[nodiscard]] json report(const std::string& folder) const {
    return json::parse(std::ifstream(folder_ / folder / "report.json"));
  }
  /// Fifteen seconds of the plant's robot, after a homing of its own.
  void record(const std::string& name, const std::string& of, int seed) const {
    make(fmt::format("trajectory sinusoid --duration-s 15 --seed {} --out {}.csv", seed, name));
    make(
        fmt::format("simulate --plant {} --trajectory {}.csv --seed {} --homing-seed {} --out "
                    "{}.db",
                    plant(of), name, seed, seed, name));
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) /
                           (std::string("diagnose_twin_") +
                            ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

std::set<std::pair<std::string, std::string>> places(const json& list) {
  std::set<std::pair<std::string, std::string>> out;
  for (const json& item : list) {
    const std::string stage = item["stage"];
    out.emplace(item["joint"], stage == "sensor" ? "transmission" : stage);
  }
  return out;
}

/// `mismatch` is where something is named or has no name, and nowhere else.
void expect_consistent(const json& report) {
  auto found = places(report["effects"]);
  found.merge(places(report["unexplained"]));
  EXPECT_EQ(places(report["mismatch"]), found) << report["verdict"];
  for (const json& m : report["mismatch"]) EXPECT_GT(m["excess_rmse"].get<double>(), 0.0) << m;
  const auto& kind = report["verdict"]["kind"];
  const bool silent = kind == "nothing_left_out" || kind == "not_testable";
  EXPECT_EQ(silent, report["mismatch"].empty()) << report["verdict"];
}

TEST_F(DiagnoseTwin, NeedsLittleMemoryWhereFewRowsSayAnythingOfAGain) {
  make("trajectory zigzag --sparsity 1/1 --out zigzag1.csv");
  make(fmt::format("simulate --plant {} --trajectory zigzag1.csv --seed 2 --out zigzag1.db",
                   plant("raven2_published")));
#ifdef RAVENCAL_SANITIZED  // a sanitizer reserves terabytes of addresses
  const std::string gigabyte;
#else
  const std::string gigabyte = "ulimit -v 1048576;";
#endif
  const Outcome diagnosed = run(fmt::format("diagnose zigzag1.db --plant {} --placebo 0 --threads "
                                            "2 --out zigzag1",
                                            plant("raven2_published")),
                                gigabyte);
  EXPECT_EQ(diagnosed.exit_code, 0) << diagnosed.text;
  const json found = report("zigzag1");
  for (const json& effect : found["effects"]) EXPECT_NE(effect["id"], "controller_gain") << effect;
  expect_consistent(found);
}

#ifndef RAVENCAL_SANITIZED
/// Whichever thread memory runs out in.
TEST_F(DiagnoseTwin, EndsWithASentenceWhereMemoryRunsOut) {
  record("fitted", "raven2_published", 1);
  constexpr int kCannotLoad = 127;  // the program itself needs more
  int refused = 0;
  for (int limit_kib = 64'000; limit_kib < 400'000; limit_kib += 4'000) {
    const Outcome outcome = run(fmt::format("diagnose fitted.db --plant {} --placebo 0 --threads 2 "
                                            "--out little",
                                            plant("raven2_published")),
                                fmt::format("ulimit -v {};", limit_kib));
    if (outcome.exit_code == kCannotLoad) continue;
    if (outcome.exit_code == 0) break;
    ++refused;
    EXPECT_EQ(outcome.exit_code, 3) << limit_kib << ": " << outcome.text;
    EXPECT_NE(outcome.text.find("memory"), std::string::npos) << limit_kib << ": " << outcome.text;
  }
  EXPECT_GT(refused, 0);
}
#endif

TEST_F(DiagnoseTwin, CountsNoConstantThatHomingDrawsAsAnError) {
  record("fitted", "raven2", 1);
  record("unseen", "raven2", 4);
  const Outcome diagnosed =
      run(fmt::format("diagnose fitted.db --held-out unseen.db --plant {} --placebo 0 --out right",
                      plant("raven2")));
  ASSERT_EQ(diagnosed.exit_code, 0) << diagnosed.text;
  const json found = report("right");
  expect_consistent(found);
  int drawn = 0;
  for (const json& figure : found["held_out"]) {
    EXPECT_EQ(figure.contains("drawn_constant"), figure["metric"] == "position_rmse") << figure;
    if (figure["metric"] != "position_rmse" || figure["joint"] != "elbow") continue;
    ++drawn;
    // The stops say where the joint is, but for what homing draws.
    EXPECT_LT(std::abs(figure["drawn_constant"].get<double>()), 0.02) << figure;
    EXPECT_LT(figure["before"].get<double>(), 0.02) << figure;
  }
  EXPECT_EQ(drawn, 1);
  for (const json& left : found["error_left"]) {
    if (left["stage"] != "transmission") continue;
    EXPECT_LT(left["before"].get<double>(), 0.02) << left;
  }
  for (const json& line : found["joints"]) {
    if (line["joint"] != "elbow") continue;
    const std::string sentence = line["sentence"];
    EXPECT_NE(sentence.find("that homing draws"), std::string::npos) << sentence;
  }
  const Outcome followed = run(fmt::format(
      "simulate --plant {} --follow fitted.db --out again.db --force --json", plant("raven2")));
  ASSERT_EQ(followed.exit_code, 0) << followed.text;
  for (const json& joint : json::parse(followed.text)["joints"]) {
    if (joint["joint"] != "elbow") continue;
    EXPECT_LT(joint["rmse"].get<double>(), 0.02) << joint;
    EXPECT_GT(std::abs(joint["drawn_constant"].get<double>()), 0.2) << joint;
  }
}

TEST_F(DiagnoseTwin, RefusesASimulationOfAnotherMotion) {
  record("fitted", "raven2", 1);
  record("unseen", "raven2", 4);
  const Outcome refused = run(fmt::format(
      "diagnose fitted.db --simulated unseen.db --plant {} --out other", plant("raven2")));
  EXPECT_EQ(refused.exit_code, 3) << refused.text;
  EXPECT_NE(refused.text.find("unseen.db: is of another motion than fitted.db: the desired "
                              "position of joint"),
            std::string::npos)
      << refused.text;
  EXPECT_NE(refused.text.find("deg RMS, and "), std::string::npos) << refused.text;
  EXPECT_FALSE(fs::exists(folder_ / "other"));
}

TEST_F(DiagnoseTwin, TakesASimulationOfTheSameMotion) {
  record("fitted", "raven2", 1);
  make(
      fmt::format("simulate --plant {} --trajectory fitted.csv --seed 9 --homing-seed 9 --out "
                  "same.db",
                  plant("raven2")));
  const Outcome taken = run(fmt::format(
      "diagnose fitted.db --simulated same.db --plant {} --placebo 0 --out same", plant("raven2")));
  EXPECT_EQ(taken.exit_code, 0) << taken.text;
}

/// Of its desired positions alone, as the profile emps has them.
void write_sines(const fs::path& path, double amplitude_m, double rate_rad_per_s) {
  std::ofstream file(path);
  file << "t_s,q_ref_m,q_meas_m,u_drive_V,force_N\n";
  for (int i = 0; i < 20'000; ++i) {
    const double t_s = 1e-3 * i;
    const double q_m = amplitude_m * (1.0 - std::cos(rate_rad_per_s * t_s));
    file << fmt::format("{:.3f},{:.9f},{:.9f},0,0\n", t_s, q_m, q_m);
  }
}

// Not of slower sines: their velocities say nearly all of the position error, and errors
// of the law in steps of time decide about its gain.
TEST_F(DiagnoseTwin, FindsTheGainThatSimulateFollowedWith) {
  const std::pair<double, double> sines[] = {{0.02, 5.0}, {0.01, 10.0}};
  int n = 0;
  for (const auto& [amplitude_m, rate_rad_per_s] : sines) {
    const std::string name = fmt::format("sine{}", n++);
    write_sines(folder_ / (name + ".csv"), amplitude_m, rate_rad_per_s);
    make(fmt::format("simulate --plant {} --follow {}.csv --profile {} --out {}.db", plant("emps"),
                     name, profile("emps"), name));
    const Outcome diagnosed = run(
        fmt::format("diagnose {}.db --plant {} --placebo 0 --out {}", name, plant("emps"), name));
    ASSERT_EQ(diagnosed.exit_code, 0) << diagnosed.text;
    const json found = report(name);
    EXPECT_TRUE(found["effects"].empty()) << name << ": " << found["verdict"]["text"];
    expect_consistent(found);
  }
}

TEST_F(DiagnoseTwin, FindsTheGainThatSimulateFollowedARealRecordingWith) {
  const fs::path recording = fs::path(RAVENCAL_DATA_DIR) / "emps/emps_train.csv";
  if (!fs::exists(recording)) GTEST_SKIP() << recording << " is not there";
  make(fmt::format("simulate --plant {} --follow {} --profile {} --out emps.db", plant("emps"),
                   recording.string(), profile("emps")));
  const Outcome diagnosed =
      run(fmt::format("diagnose emps.db --plant {} --placebo 0 --out emps", plant("emps")));
  ASSERT_EQ(diagnosed.exit_code, 0) << diagnosed.text;
  for (const json& effect : report("emps")["effects"])
    EXPECT_NE(effect["id"], "controller_gain") << effect;
}

}  // namespace
