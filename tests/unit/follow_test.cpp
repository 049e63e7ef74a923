// SPDX-License-Identifier: Apache-2.0
//
// Plants along a recording of their robot. The robots here are integrated by this file, not by the
// code under test.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "simulation/follow.hpp"

namespace {

using namespace ravencal;
using record::Role;

constexpr double kDt_s = 1e-3;

record::Recording recording_of(const std::vector<record::Channel>& channels, Eigen::Index rows,
                               double dt_s) {
  record::Recording r;
  r.channels = channels;
  r.samples.setZero(rows, static_cast<Eigen::Index>(channels.size()));
  for (Eigen::Index i = 0; i < rows; ++i)
    r.t_ns.push_back(std::llround(1e9 * dt_s * static_cast<double>(i)));
  r.source = "test";
  return r;
}

constexpr const char* kSlide = R"(
[robot]
name = "slide"
gravity_m_per_s2 = [0.0, 0.0, 0.0]
tool_joints_rad = [0.0, 0.0, 0.0, 0.0]
[[joint]]
name = "slide"
kind = "prismatic"
motor_inertia_kg_m2 = 10.0
gearbox_ratio = 1.0
reduction_rad_per_m = 1.0
joint_encoder_resolution_m = 1e-6
  [joint.drive]
  input = "force_n"
)";
constexpr const char* kFriction = R"(
  [[joint.effect]]
  id = "coulomb_friction"
  level_n = 5.0
  [[joint.effect]]
  id = "viscous_friction"
  damping_n_s_per_m = 40.0
)";
constexpr const char* kServo = R"(
  [joint.controller]
  kp_n_m_per_rad = 20000.0
  kd_n_m_s_per_rad = 800.0
  dac_limit_counts = 0.0
)";

physics::Plant plant_of(const std::string& text) {
  auto plant = physics::parse_plant(text, "test.toml");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  return std::move(plant).value();
}

/// 10 kg with Coulomb and viscous friction under a servo that follows two sines.
record::Recording slide_recording() {
  constexpr Eigen::Index kRows = 10'000;
  auto r = recording_of({{"desired", "m", Role::kDesiredPosition, "slide"},
                         {"motor", "rad", Role::kMotorPosition, "slide"},
                         {"force", "N", Role::kDriveTorque, "slide"}},
                        kRows, kDt_s);
  double q = 0.0, v = 0.0;
  for (Eigen::Index i = 0; i < kRows; ++i) {
    const double t_s = kDt_s * static_cast<double>(i);
    const double desired = 0.05 * std::sin(2.0 * t_s) + 0.02 * std::sin(5.3 * t_s);
    const double force = 20'000.0 * (desired - q) - 800.0 * v;
    r.samples.row(i) << desired, q, force;
    for (int k = 0; k < 20; ++k) {
      const double friction = 5.0 * std::tanh(v / 1e-4) + 40.0 * v;
      v += kDt_s / 20.0 * (force - friction) / 10.0;
      q += kDt_s / 20.0 * v;
    }
  }
  return r;
}

double error_of(const physics::Plant& plant, const record::Recording& r,
                const simulation::FollowOptions& options = {}) {
  const auto followed = simulation::follow_recording(plant, r, options);
  EXPECT_TRUE(followed.ok()) << (followed.ok() ? "" : followed.error().message);
  EXPECT_EQ(followed->recording.rows(), r.rows());
  return followed->joints.front().rmse_ji;
}

TEST(Follow, ComesBackToTheRobotUnderItsEffortsOnlyWithItsFriction) {
  const auto recording = slide_recording();
  const double with = error_of(plant_of(std::string(kSlide) + kFriction), recording);
  const double without = error_of(plant_of(kSlide), recording);
  EXPECT_LT(with, 2e-3);
  EXPECT_GT(without, 10.0 * with);
}

TEST(Follow, ClosesTheLoopWhereThePlantHasAServo) {
  const auto recording = slide_recording();
  const auto plant = plant_of(std::string(kSlide) + kServo + kFriction);
  const auto followed = simulation::follow_recording(plant, recording, {});
  ASSERT_TRUE(followed.ok()) << followed.error().message;
  EXPECT_LT(followed->joints.front().rmse_ji, 1e-4);
  const auto force = *followed->recording.column(Role::kDriveTorque, "slide");
  const Eigen::VectorXd difference =
      followed->recording.samples.col(force) - recording.samples.col(force);
  EXPECT_LT(difference.norm(), 0.2 * recording.samples.col(force).norm())
      << "the servo's effort is simulated as well";
  simulation::FollowOptions open;
  open.open_loop = true;
  EXPECT_GT(error_of(plant, recording, open), 0.0);
}

constexpr const char* kTwo = R"(
[robot]
name = "two"
gravity_m_per_s2 = [0.0, 0.0, 0.0]
tool_joints_rad = [0.0, 0.0, 0.0, 0.0]
[[joint]]
name = "one"
kind = "revolute"
motor_inertia_kg_m2 = 1e-5
gearbox_ratio = 1.0
reduction = 1.0
joint_encoder_resolution_rad = 1e-5
  [[joint.effect]]
  id = "homing_offset"
  deviation_rad = 0.0
  offset_rad = 0.1
  [[joint.effect]]
  id = "coupling"
  from = "two"
  error_rad_per_rad = 0.2
  [[joint.effect]]
  id = "hysteresis"
  from = "two"
  half_loop_rad = 0.03
  width_rad = 0.05
  [[joint.effect]]
  id = "hysteresis"
  half_loop_rad = 0.02
  width_rad = 0.04
  [[joint.effect]]
  id = "compliance"
  from = "push"
  stretch_per_load_rad = 0.01
[[joint]]
name = "two"
kind = "revolute"
motor_inertia_kg_m2 = 1e-5
gearbox_ratio = 1.0
reduction = 1.0
joint_encoder_resolution_rad = 1e-5
)";

record::Recording two_recording() {
  return recording_of({{"e1", "rad", Role::kJointEstimate, "one"},
                       {"t1", "rad", Role::kJointTruth, "one"},
                       {"e2", "rad", Role::kJointEstimate, "two"},
                       {"push", "N", Role::kLoad, ""}},
                      200, 0.1);
}

TEST(Follow, PlacesAJointByItsPositionsAndLoadsAlone) {
  auto r = two_recording();
  for (Eigen::Index i = 0; i < r.rows(); ++i) {
    // Joint one goes up for a hundred rows and down again; joint two goes up only.
    const double up = static_cast<double>(i < 100 ? i : 200 - i);
    r.samples.row(i) << 0.01 * up, 0.0, 0.01 * static_cast<double>(i), i < 150 ? 0.0 : 2.0;
  }
  const auto followed = simulation::follow_recording(plant_of(kTwo), r, {});
  ASSERT_TRUE(followed.ok()) << followed.error().message;
  const auto truth = [&](Eigen::Index i) { return followed->recording.samples(i, 1); };
  const auto rest = [&](Eigen::Index i) {
    return r.samples(i, 0) + 0.1 + 0.2 * r.samples(i, 2) - 0.03;
  };
  EXPECT_NEAR(truth(90), rest(90) - 0.02, 1e-12) << "behind its command on the way up";
  EXPECT_NEAR(truth(140), rest(140) + 0.02, 1e-12) << "ahead of it on the way down";
  EXPECT_NEAR(truth(190), rest(190) + 0.02 - 0.02, 1e-12) << "two newtons push it back";
  EXPECT_EQ(followed->recording.samples.col(2), r.samples.col(2)) << "what was given stays";
}

TEST(Follow, LetsALoopFollowItsJointWhereAnotherMovesIt) {
  auto r = two_recording();
  for (Eigen::Index i = 0; i < r.rows(); ++i) {
    // The command of joint one stands; joint two goes up for a hundred rows and down again.
    r.samples.row(i) << 0.0, 0.0, 0.01 * static_cast<double>(i < 100 ? i : 200 - i), 0.0;
  }
  const auto followed = simulation::follow_recording(plant_of(kTwo), r, {});
  ASSERT_TRUE(followed.ok()) << followed.error().message;
  const auto moved = [&](Eigen::Index i) {
    return followed->recording.samples(i, 1) - 0.1 - 0.2 * r.samples(i, 2);
  };
  EXPECT_NEAR(moved(90), -0.03 - 0.02, 1e-12) << "both loops hang behind";
  EXPECT_NEAR(moved(190), 0.03 + 0.02, 1e-12);
}

TEST(Follow, LetsFrictionOfADriveFollowTheDrive) {
  const std::string one = kTwo;
  const auto plant = plant_of("coupling = [[0, 0], [-0.5, 0]]\n" + one.substr(0, one.find("  [[")) +
                              one.substr(one.rfind("[[joint]]")) + R"(
  [[joint.effect]]
  id = "coulomb_friction"
  lag_rad = 0.02
  width_rad = 0.04
)");
  auto r = recording_of({{"d1", "rad", Role::kDesiredPosition, "one"},
                         {"d2", "rad", Role::kDesiredPosition, "two"},
                         {"e1", "rad", Role::kJointEstimate, "one"},
                         {"e2", "rad", Role::kJointEstimate, "two"}},
                        200, 0.1);
  // Joint two stands; its motor turns up and down again to make up for joint one.
  for (Eigen::Index i = 0; i < r.rows(); ++i)
    r.samples(i, 0) = 0.01 * static_cast<double>(i < 100 ? i : 200 - i);
  const auto followed = simulation::follow_recording(plant, r, {});
  ASSERT_TRUE(followed.ok()) << followed.error().message;
  EXPECT_NEAR(followed->recording.samples(90, 3), -0.02, 1e-12) << "behind on the way up";
  EXPECT_NEAR(followed->recording.samples(190, 3), 0.02, 1e-12);
  EXPECT_EQ(followed->recording.samples.col(2), r.samples.col(0));
}

TEST(Follow, HangsAJointBehindItsCable) {
  const auto plant = plant_of(R"(
[robot]
name = "pendulum"
gravity_m_per_s2 = [0.0, -9.8, 0.0]
tool_joints_rad = [0.0, 0.0, 0.0, 0.0]
[[joint]]
name = "one"
kind = "revolute"
motor_inertia_kg_m2 = 1e-5
gearbox_ratio = 1.0
reduction = 1.0
joint_encoder_resolution_rad = 1e-5
  [joint.link]
  mass_kg = 2.0
  com_m = [0.3, 0.0, 0.0]
  inertia_kg_m2 = [0.0, 0.0, 0.0]
  [[joint.effect]]
  id = "compliance"
  stiffness_n_m_per_rad = 60.0
  damping_n_m_s_per_rad = 0.0
)");
  auto r = recording_of(
      {{"e1", "rad", Role::kJointEstimate, "one"}, {"t1", "rad", Role::kJointTruth, "one"}}, 400,
      0.05);
  for (Eigen::Index i = 0; i < r.rows(); ++i) r.samples(i, 0) = 0.005 * static_cast<double>(i);
  const auto followed = simulation::follow_recording(plant, r, {});
  ASSERT_TRUE(followed.ok()) << followed.error().message;
  for (const Eigen::Index i : {100, 200, 300}) {
    const double joint = followed->recording.samples(i, 1);
    EXPECT_NEAR(60.0 * (r.samples(i, 0) - joint), 2.0 * 9.8 * 0.3 * std::cos(joint), 0.03);
  }
}

TEST(Follow, SaysWhichSignalIsMissing) {
  auto r = two_recording();
  r.channels[3].name = "pull";
  const auto followed = simulation::follow_recording(plant_of(kTwo), r, {});
  ASSERT_FALSE(followed.ok());
  EXPECT_NE(followed.error().message.find("'push'"), std::string::npos) << followed.error().message;
}

TEST(Follow, RefusesARecordingWithNothingToFollow) {
  const auto r = recording_of({{"x", "rad", Role::kFeature, "one"}}, 100, 0.1);
  const auto followed = simulation::follow_recording(plant_of(kTwo), r, {});
  ASSERT_FALSE(followed.ok());
  EXPECT_EQ(followed.error().code, core::ErrorCode::kData);
}

}  // namespace
