// SPDX-License-Identifier: Apache-2.0
#include "learn/motion_range.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "learn/evaluate.hpp"
#include "learn/train.hpp"

namespace ravencal::learn {
namespace {

using record::Recording;
using record::Role;

constexpr double kCount_rad = 1e-3;  // of the joint's encoder

/// An elbow that swings by 0.5 rad at `frequency_hz`, 100 Hz, 20 s; the drive pushes with
/// `load_n_m` in the direction of motion, and the joint gives way by 0.01 rad per N m.
Recording swing(double frequency_hz, double load_n_m) {
  Recording arm;
  arm.source = "swing.db";
  arm.channels = {{"elbow.estimate", "rad", Role::kJointEstimate, "elbow"},
                  {"elbow.truth", "rad", Role::kJointTruth, "elbow"},
                  {"elbow.torque", "N_m", Role::kDriveTorque, "elbow"}};
  arm.samples.resize(2000, 3);
  for (int row = 0; row < 2000; ++row) {
    const double phase = 2.0 * std::numbers::pi * frequency_hz * row * 0.01;
    const double estimate = kCount_rad * std::round(0.5 * std::sin(phase) / kCount_rad);
    const double torque = load_n_m * std::cos(phase);
    arm.t_ns.push_back(row * 10'000'000LL);
    arm.samples.row(row) << estimate, estimate + 0.1 + 0.01 * torque, torque;
  }
  return arm;
}

const std::vector<model::OutputSpec> kElbow = {{"elbow", "elbow.estimate", "rad"}};

model::MotionRange range_of_swing() {
  const Recording training = swing(0.2, 1.0);
  const Recording* const recordings[] = {&training};
  return motion_range(kElbow, recordings);
}

double share_beyond(const Recording& recording) {
  return static_cast<double>(beyond_motion(range_of_swing(), kElbow, recording).count()) /
         static_cast<double>(recording.rows());
}

TEST(JointSpeeds, AreThoseOfTheJointAndNotOfItsEncodersCounts) {
  const Recording arm = swing(0.2, 1.0);
  const Eigen::MatrixXd speeds = joint_speeds(kElbow, arm);
  const double top = 0.5 * 2.0 * std::numbers::pi * 0.2;
  for (int row = 0; row < 2000; ++row) {
    const double speed = top * std::cos(2.0 * std::numbers::pi * 0.2 * row * 0.01);
    const bool is_end = row < 5 || row >= 1995;  // fewer rows on one side
    EXPECT_NEAR(speeds(row, 0), speed, is_end ? 0.1 : 0.02) << row;
  }
}

TEST(JointSpeeds, DoNotReachOverEpisodesAndGaps) {
  Recording arm = swing(0.0, 0.0);
  arm.samples.col(0).segment(500, 500).setConstant(1.0);
  arm.samples.col(0).tail(1000).setConstant(3.0);
  arm.events.push_back({arm.t_ns[500], "episode", ""});
  for (std::size_t row = 1000; row < 2000; ++row) arm.t_ns[row] += 1'000'000'000LL;
  EXPECT_EQ(joint_speeds(kElbow, arm).cwiseAbs().maxCoeff(), 0.0);
}

TEST(JointSpeeds, AreUnknownWithoutTimeOrEstimate) {
  Recording arm = swing(0.2, 1.0);
  arm.channels[0].name = "other";
  EXPECT_TRUE(joint_speeds(kElbow, arm).array().isNaN().all());
  arm.channels[0].name = "elbow.estimate";
  std::fill(arm.t_ns.begin(), arm.t_ns.end(), 0);
  EXPECT_TRUE(joint_speeds(kElbow, arm).array().isNaN().all());
}

TEST(JointEfforts, AreMeansOverATenthOfASecond) {
  Recording arm = swing(0.0, 1.0);
  for (int row = 0; row < 2000; row += 2) arm.samples(row, 2) = -1.0;  // noise of a drive
  arm.samples(700, 2) = std::nan("");
  const Eigen::MatrixXd efforts = joint_efforts(kElbow, arm);
  EXPECT_LT(efforts.middleRows(5, 1990).cwiseAbs().maxCoeff(), 0.201);
  arm.channels[2].role = Role::kFeature;
  EXPECT_TRUE(joint_efforts(kElbow, arm).array().isNaN().all());
}

TEST(MotionRange, HoldsTheMotionOfTheTrainingAndALittleMore) {
  const model::MotionRange range = range_of_swing();
  ASSERT_EQ(range.size(), 1U);
  EXPECT_NEAR(range[0].speed.high, 0.628, 0.02);
  EXPECT_NEAR(range[0].speed.low, -0.628, 0.02);
  EXPECT_NEAR(range[0].load.high, 1.0, 0.01);
  EXPECT_EQ(range[0].load_channel, "elbow.torque");
  EXPECT_EQ(share_beyond(swing(0.2, 1.0)), 0.0);
  EXPECT_EQ(share_beyond(swing(0.22, 1.1)), 0.0);
  EXPECT_EQ(share_beyond(swing(0.05, 0.1)), 0.0);
}

TEST(MotionRange, LeavesOutFasterMotionAndLargerLoads) {
  EXPECT_NEAR(share_beyond(swing(0.4, 1.0)), 0.57, 0.03);  // of a sine, above 1.25 / 2
  EXPECT_NEAR(share_beyond(swing(0.2, 2.0)), 0.57, 0.03);
}

TEST(MotionRange, LeavesOutNothingThatIsUnknown) {
  Recording still = swing(0.4, 2.0);
  std::fill(still.t_ns.begin(), still.t_ns.end(), 0);
  still.channels[2].name = "elbow.current";  // of another unit than the training's torque
  EXPECT_EQ(share_beyond(still), 0.0);
}

TEST(MotionRange, SplitsTheErrorsOfAnEvaluation) {
  const Recording training = swing(0.2, 1.0);
  Recording faster = swing(0.4, 1.0);
  const Recording* const recordings[] = {&training};
  const Recording* const tested[] = {&faster};
  TrainOptions options;
  options.hidden.clear();
  const auto trained =
      train_model(recordings, {}, options, [](const EpochReport&) { return true; });
  ASSERT_TRUE(trained.ok()) << trained.error().message;
  ASSERT_TRUE(trained->model.motion.has_value());
  const auto beyond = beyond_motion(*trained->model.motion, kElbow, faster);
  for (Eigen::Index row = 0; row < faster.rows(); ++row)
    if (beyond(row, 0)) faster.samples(row, 1) += 0.05;
  const auto evaluation = evaluate(trained->model, tested);
  ASSERT_TRUE(evaluation.ok()) << evaluation.error().message;
  const auto& split = evaluation->joints[0].motion;
  ASSERT_TRUE(split.has_value());
  EXPECT_EQ(split->rows_beyond, static_cast<std::size_t>(beyond.count()));
  EXPECT_NEAR(split->beyond_rmse, 0.05, 0.001);
  EXPECT_LT(split->within_rmse, 0.001);
  EXPECT_NE(evaluation_table(*evaluation).find("trained motion"), std::string::npos);
  const auto joint = nlohmann::json::parse(evaluation_json(*evaluation))["joints"][0];
  EXPECT_EQ(joint["beyond_trained_motion"]["samples"], split->rows_beyond);
  EXPECT_NEAR(joint["beyond_trained_motion"]["rmse"], 0.05 * 57.3, 0.1);
  EXPECT_LT(joint["within_trained_motion"]["rmse"], 0.1);
}

TEST(MotionRange, ShowsADashWhereNoRowIsBeyondAndNothingForAModelThatDoesNotKnow) {
  const Recording training = swing(0.2, 1.0);
  const Recording* const recordings[] = {&training};
  TrainOptions options;
  options.hidden.clear();
  auto trained = train_model(recordings, {}, options, [](const EpochReport&) { return true; });
  ASSERT_TRUE(trained.ok()) << trained.error().message;
  const auto with = evaluate(trained->model, recordings);
  ASSERT_TRUE(with.ok());
  EXPECT_TRUE(evaluation_table(*with).ends_with("-        -\n")) << evaluation_table(*with);
  const auto joint = nlohmann::json::parse(evaluation_json(*with))["joints"][0];
  EXPECT_TRUE(joint["beyond_trained_motion"]["rmse"].is_null());
  trained->model.motion.reset();
  const auto without = evaluate(trained->model, recordings);
  ASSERT_TRUE(without.ok());
  EXPECT_EQ(evaluation_table(*without).find("motion"), std::string::npos);
  EXPECT_EQ(evaluation_json(*without).find("motion"), std::string::npos);
}

}  // namespace
}  // namespace ravencal::learn
