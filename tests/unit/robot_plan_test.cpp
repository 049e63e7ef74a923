// SPDX-License-Identifier: Apache-2.0
//
// Checks that need no robot: the plan of a run, and the list of calibration steps that can be
// continued.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "robot/calibration_steps.hpp"
#include "robot/run_plan.hpp"
#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;

robot::RunArguments arguments_for(const trajectory::Trajectory& trajectory) {
  robot::RunArguments arguments;
  arguments.trajectory = (scratch_folder() / "path.csv").string();
  arguments.out = (scratch_folder() / "path.db").string();
  EXPECT_TRUE(trajectory::write_csv(trajectory, arguments.trajectory).ok());
  return arguments;
}

TEST(RunPlan, TellsDurationAndLimitsOfAZigzagAtTheAuthorsSpeeds) {
  const auto zigzag = trajectory::make_zigzag({});
  ASSERT_TRUE(zigzag.ok());
  const robot::RunArguments arguments = arguments_for(*zigzag);
  const auto plan = robot::make_plan(arguments);
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  // The generator works at the same speeds, so hardly anything is stretched.
  EXPECT_NEAR(plan->duration_s, zigzag->duration_s(), 0.01 * zigzag->duration_s());
  const auto json = nlohmann::json::parse(robot::plan_json(arguments, *plan));
  EXPECT_EQ(json["topic"], "servo_jr of the CRTK arm that a probe finds");
  EXPECT_NEAR(json["joints"][0]["max_speed"].get<double>(), 2.182 * std::numbers::pi / 180.0,
              1e-12);
  EXPECT_EQ(json["joints"][0]["max_increment"], 0.0025);
  EXPECT_EQ(json["joints"][2]["max_increment"], 5e-5);
  EXPECT_NE(robot::plan_text(arguments, *plan).find("insertion"), std::string::npos);
}

TEST(RunPlan, StretchesRandomMotionUnlessItMayGoFaster) {
  trajectory::RandomOptions random;
  random.duration_s = 60.0;
  const auto motion = trajectory::make_random(random);
  ASSERT_TRUE(motion.ok());
  robot::RunArguments arguments = arguments_for(*motion);
  const auto slow = robot::make_plan(arguments);
  arguments.max_speed = {3.0, 4.0, 7.0};
  const auto fast = robot::make_plan(arguments);
  ASSERT_TRUE(slow.ok() && fast.ok());
  EXPECT_GT(slow->duration_s, 60.0);
  EXPECT_NEAR(fast->duration_s, 60.0, 0.1);
}

TEST(RunPlan, RefusesWhatLeavesTheLimitsOrIsMissing) {
  robot::RunArguments arguments;
  EXPECT_EQ(robot::make_plan(arguments).error().code, core::ErrorCode::kUsage);
  trajectory::Trajectory path;
  path.t_s = {0.0, 1.0};
  path.joints_ji = {Eigen::Vector3d(0.5, 1.5, 0.40), Eigen::Vector3d(0.5, 1.5, 0.44)};
  const auto outside = robot::make_plan(arguments_for(path));
  ASSERT_FALSE(outside.ok());
  EXPECT_EQ(outside.error().code, core::ErrorCode::kData);
  EXPECT_NE(
      outside.error().message.find(":3: insertion at 0.4400 m is above its limit of 0.4300 m"),
      std::string::npos)
      << outside.error().message;
}

TEST(RunPlan, CommandsTheNamedCrtkArmOrEitherUntilAProbeHasFoundIt) {
  robot::RunArguments arguments;
  EXPECT_FALSE(arguments.named_crtk_arm().has_value());
  EXPECT_EQ(arguments.crtk_arms().size(), 2U);
  arguments.crtk_arm = "arm2";
  ASSERT_TRUE(arguments.named_crtk_arm().has_value());
  EXPECT_EQ(arguments.crtk_arms().size(), 1U);
  EXPECT_EQ(robot::command_topic_of(*arguments.named_crtk_arm(), "jp"), "/arm2/servo_jp");
}

class Evening : public testing::Test {
 protected:
  void SetUp() override {
    options_.folder = scratch_folder() / "evening";
    fs::remove_all(options_.folder);
  }
  robot::CalibrationOptions options_;
};

TEST_F(Evening, GoesFromLookingToWeightsAndNeverTrainsOnItsTest) {
  const auto steps = robot::calibration_steps(options_);
  EXPECT_EQ(steps.front().id, "check");
  EXPECT_EQ(steps[1].id, "home");
  EXPECT_EQ(steps.back().id, "convert");
  EXPECT_EQ(std::count_if(steps.begin(), steps.end(), [](const auto& step) { return step.moves; }),
            7);
  const auto train =
      std::find_if(steps.begin(), steps.end(), [](const auto& step) { return step.id == "train"; });
  ASSERT_NE(train, steps.end());
  const std::string test = (options_.folder / "test.db").string();
  EXPECT_EQ(std::count(train->command.begin(), train->command.end(), test), 0);
  for (const auto& step : steps)
    EXPECT_EQ(step.moves, step.command[0] == "run" && !step.output.empty());
  EXPECT_NE(robot::what_to_load(options_).find("weights.blob"), std::string::npos);
}

TEST_F(Evening, IsContinuedWhereItWasAndRepeatsWhatIsGone) {
  const auto steps = robot::calibration_steps(options_);
  const robot::CalibrationStep& path = steps[2];
  {
    auto session = robot::CalibrationSession::open(options_);
    ASSERT_TRUE(session.ok());
    EXPECT_FALSE(session->continued());
    std::ofstream(path.output) << "x";
    ASSERT_TRUE(session->mark_done(path).ok());
    ASSERT_TRUE(session->mark_done(steps[0]).ok());
  }
  auto again = robot::CalibrationSession::open(options_);
  ASSERT_TRUE(again.ok());
  EXPECT_TRUE(again->continued());
  EXPECT_TRUE(again->done(path));
  EXPECT_FALSE(again->done(steps[0])) << "looking is done every time";
  EXPECT_FALSE(again->done(steps[3]));
  fs::remove(path.output);
  EXPECT_FALSE(again->done(path));
}

TEST_F(Evening, RefusesAFolderOfOtherSettingsOrOfSomethingElse) {
  ASSERT_TRUE(robot::CalibrationSession::open(options_).ok());
  options_.epochs = 7;
  const auto other = robot::CalibrationSession::open(options_);
  ASSERT_FALSE(other.ok());
  EXPECT_EQ(other.error().code, core::ErrorCode::kUsage);
  std::ofstream(options_.folder / "calibrate.json") << "{";
  const auto broken = robot::CalibrationSession::open(options_);
  ASSERT_FALSE(broken.ok());
  EXPECT_EQ(broken.error().code, core::ErrorCode::kData);
}

TEST_F(Evening, SetsAStoppedRecordingAside) {
  fs::create_directories(options_.folder);
  const fs::path output = options_.folder / "zigzag.db";
  ASSERT_TRUE(robot::set_aside(output).ok()) << "nothing to do";
  for (int i = 1; i <= 2; ++i) {
    std::ofstream(output) << i;
    ASSERT_TRUE(robot::set_aside(output).ok());
    EXPECT_FALSE(fs::exists(output));
    EXPECT_TRUE(fs::exists(options_.folder / ("zigzag.stopped-" + std::to_string(i) + ".db")));
  }
}

}  // namespace
}  // namespace ravencal::test
