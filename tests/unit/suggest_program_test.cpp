// SPDX-License-Identifier: Apache-2.0
//
// The trajectories of `ravencal suggest --out` stay within what the diagnosed recordings showed,
// and the twin runs them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "trajectory/trajectory.hpp"
#include "unit/long_arm.hpp"
#include "unit/run_command.hpp"

namespace {

namespace fs = std::filesystem;
using namespace ravencal;
using Json = nlohmann::json;
using test::Outcome;

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
const Eigen::Vector3d kLow(30 * kRadPerDeg, 70 * kRadPerDeg, 0.35);
const Eigen::Vector3d kHigh(50 * kRadPerDeg, 95 * kRadPerDeg, 0.40);
const Eigen::Vector3d kFastest(0.2, 0.3, 0.02);
constexpr std::array kJoints = {"shoulder", "elbow", "insertion"};

/// Ties and untested effects that ask for every motion of the menu.
Json report() {
  Json out = {{"schema", 1}, {"unexplained", Json::array()}, {"not_found", Json::array()}};
  out["effects"] = {{{"id", "compliance"},
                     {"joint", "elbow"},
                     {"separate_by", ""},
                     {"parameters", Json::array()},
                     {"ambiguous_with", {"gain_error"}}}};
  for (const char* id : {"viscous_friction", "creep", "presliding", "coupling", "eccentricity"})
    out["not_found"].push_back(
        {{"id", id}, {"joint", "elbow"}, {"not_testable_because", id}, {"by_recording", true}});
  for (Eigen::Index j = 0; j < 3; ++j)
    out["looked_at"].push_back({{"joint", kJoints[static_cast<std::size_t>(j)]},
                                {"position", {kLow[j], kHigh[j]}},
                                {"position_unit", j < 2 ? "rad" : "m"},
                                {"effort_unit", j < 2 ? "N_m" : "N"},
                                {"fastest", kFastest[j]},
                                {"load", nullptr}});
  return out;
}

class SuggestProgram : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "why");
    write(report());
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const Json& json) const { std::ofstream(folder_ / "why/report.json") << json; }

  [[nodiscard]] Outcome run(const std::string& arguments) const {
    return test::run_command(
        fmt::format("cd {} && {} {} 2>&1", folder_.string(), RAVENCAL_PROGRAM, arguments));
  }

  [[nodiscard]] std::vector<fs::path> trajectories() const {
    std::vector<fs::path> out;
    for (const auto& entry : fs::directory_iterator(folder_ / "next")) out.push_back(entry.path());
    return out;
  }

  const std::string plant_ = std::string(RAVENCAL_SOURCE_DIR) + "/tools/plants/raven2.toml";
  const std::string suggest_ = fmt::format("suggest why --plant {} --out next", plant_);
  fs::path folder_ = fs::path(::testing::TempDir()) /
                     (std::string("suggest_program_") +
                      ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(SuggestProgram, MovesWithinThePositionsAndSpeedsThatWereRecorded) {
  const Outcome next = run(suggest_);
  ASSERT_EQ(next.exit_code, 0) << next.text;
  const std::vector<fs::path> files = trajectories();
  EXPECT_EQ(files.size(), 6U) << next.text;
  for (const fs::path& file : files) {
    const auto motion = trajectory::read_csv(file);
    ASSERT_TRUE(motion.ok()) << motion.error().message;
    Eigen::Vector3d fastest = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < motion->t_s.size(); ++i) {
      EXPECT_TRUE((motion->joints_ji[i].array() >= kLow.array() - 1e-9).all()) << file;
      EXPECT_TRUE((motion->joints_ji[i].array() <= kHigh.array() + 1e-9).all()) << file;
      if (i > 0)
        fastest = fastest.cwiseMax((motion->joints_ji[i] - motion->joints_ji[i - 1]).cwiseAbs() /
                                   (motion->t_s[i] - motion->t_s[i - 1]));
    }
    EXPECT_TRUE((fastest.array() <= 1.001 * kFastest.array()).all()) << file << fastest;
    EXPECT_GT(fastest.cwiseQuotient(kFastest).maxCoeff(), 0.1) << file;
  }
  EXPECT_NE(next.text.find("elbow 70.0 to 95.0 deg at up to 17.2 deg/s"), std::string::npos)
      << next.text;
}

TEST_F(SuggestProgram, WritesWhatSimulateTakesAndReplacesNothingUnasked) {
  ASSERT_EQ(run(suggest_).exit_code, 0);
  const Outcome simulated = run(fmt::format("simulate --plant {} --trajectory {} --out twin.db",
                                            plant_, trajectories().front().string()));
  EXPECT_EQ(simulated.exit_code, 0) << simulated.text;
  EXPECT_NE(run(suggest_).exit_code, 0);
  EXPECT_EQ(run(suggest_ + " --force").exit_code, 0);
}

TEST_F(SuggestProgram, SaysWhyThereIsNoTrajectory) {
  Json still = report();
  still["looked_at"][1]["fastest"] = 0.0;
  write(still);
  const Outcome next = run(suggest_);
  EXPECT_EQ(next.exit_code, 3) << next.text;
  EXPECT_NE(next.text.find("joint elbow did not move"), std::string::npos) << next.text;
  EXPECT_EQ(run("suggest why").exit_code, 0);
}

/// Seven joints, one of them slides; each was recorded over half of its travel.
TEST_F(SuggestProgram, MovesEveryJointOfAnyArmWithinItsRecordingsAndItsLimits) {
  std::ofstream(folder_ / "arm.toml") << test::long_arm(7);
  const physics::Plant plant = physics::load_plant(folder_ / "arm.toml").value();
  const trajectory::JointLimits limits = trajectory::limits_of(plant).value();
  Json seen = report();
  seen["effects"][0]["joint"] = "j3";
  for (Json& untested : seen["not_found"]) untested["joint"] = "j3";
  seen["looked_at"] = Json::array();
  const Eigen::VectorXd low = limits.low_ji, high = 0.5 * (low + limits.high_ji);
  const auto reported = [&](Eigen::Index j) { return j == 6 ? limits.low_ji[j] - 0.1 : low[j]; };
  for (Eigen::Index j = 0; j < 7; ++j) {
    const bool slides = j == test::kSliding;
    seen["looked_at"].push_back({{"joint", plant.joints[static_cast<std::size_t>(j)].name},
                                 {"position", {reported(j), high[j]}},
                                 {"position_unit", slides ? "m" : "rad"},
                                 {"effort_unit", slides ? "N" : "N_m"},
                                 {"fastest", 2.0 * limits.fastest_ji[j]},
                                 {"load", nullptr}});
  }
  write(seen);
  const Outcome next = run("suggest why --plant arm.toml --out next");
  ASSERT_EQ(next.exit_code, 0) << next.text;
  EXPECT_EQ(trajectories().size(), 6U) << next.text;
  for (const fs::path& file : trajectories()) {
    const auto motion = trajectory::read_for_plant(file, plant);
    ASSERT_TRUE(motion.ok()) << motion.error().message;
    for (const Eigen::VectorXd& joints : motion->joints_ji) {
      ASSERT_GE((joints - low).minCoeff(), -1e-8) << file;
      ASSERT_GE((high - joints).minCoeff(), -1e-8) << file;
    }
  }
  const Outcome simulated = run(fmt::format("simulate --plant arm.toml --trajectory {} --out x.db",
                                            trajectories().front().string()));
  EXPECT_EQ(simulated.exit_code, 0) << simulated.text;
}

/// Two repetitions of a tie: what they answered, and what that tells.
TEST_F(SuggestProgram, SaysHowMuchARecordingWouldTell) {
  fs::copy_file(plant_, folder_ / "why/plant_improved.toml");
  const Outcome next =
      run(fmt::format("suggest why --plant {} --try 1 --repetitions 1 --json "
                      "2>/dev/null",
                      plant_));
  ASSERT_EQ(next.exit_code, 0) << next.text;
  const Json first = Json::parse(next.text)["suggestions"][0];
  ASSERT_TRUE(first.contains("predicted")) << next.text;
  const double bits = first["predicted"]["information_bits"];
  EXPECT_GE(bits, 0.0);
  EXPECT_LT(bits, 1.0);
  EXPECT_EQ(Json::parse(next.text)["explored"].size(), 3U);
}

}  // namespace
