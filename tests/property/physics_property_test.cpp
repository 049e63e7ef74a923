// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>
#include <Eigen/LU>

#include <cmath>
#include <string>

#include "physics/effects/backlash.hpp"
#include "physics/effects/hysteresis.hpp"
#include "physics/raven_controller.hpp"
#include "physics/raven_kinematics.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::physics {
namespace {

using Eigen::Vector3d;

double between(double low, double high) {
  return low + (high - low) * 1e-6 * *rc::gen::inRange(0, 1'000'001);
}

const Plant& shipped_plant() {
  static const Plant plant =
      *load_plant(std::string(RAVENCAL_SOURCE_DIR) + "/tools/plants/raven2.toml");
  return plant;
}

RC_GTEST_PROP(CouplingProperty, JointsToMotorsAndBackIsTheIdentity, ()) {
  const Vector3d joints(between(-3, 3), between(-3, 3), between(0.1, 0.7));
  const Vector3d back =
      joints_from_motors(shipped_plant(), motors_from_joints(shipped_plant(), joints));
  RC_ASSERT((back - joints).cwiseAbs().maxCoeff() < 1e-12);
}

RC_GTEST_PROP(CouplingProperty, ToolMotorsAndBackIsTheIdentity, ()) {
  const Arm arm = *rc::gen::element(Arm::kGold, Arm::kGreen);
  SlotVector joints{};
  SlotVector motors{};
  motors[2] = between(0, 1200);
  for (std::size_t slot = 4; slot < 8; ++slot) joints[slot] = between(-3, 3);
  tool_motors_from_joints(arm, joints, motors);
  SlotVector back{};
  tool_joints_from_motors(arm, motors, back);
  for (std::size_t slot = 4; slot < 8; ++slot)
    RC_ASSERT(std::abs(back[slot] - joints[slot]) < 1e-9);
}

RC_GTEST_PROP(KinematicsProperty, RotationsAreProper, ()) {
  SlotVector joints{};
  for (std::size_t slot = 0; slot < 8; ++slot) joints[slot] = between(-3, 3);
  const ToolPose pose = forward_kinematics(*rc::gen::element(Arm::kGold, Arm::kGreen), joints);
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> rotation(
      pose.rotation.data());
  RC_ASSERT((rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-9);
  RC_ASSERT(rotation.determinant() > 0.99);
}

RC_GTEST_PROP(HysteresisProperty, EffortStaysWithinItsElementsAndDissipates, ()) {
  const double stiffness = between(1, 1000);
  const double yield = between(1e-4, 1e-2);
  Hysteresis hysteresis(stiffness, yield);
  const double bound = stiffness * yield * (0.25 + 0.5 + 0.75 + 1.0) / 4.0;
  double work = 0.0;
  const int steps = *rc::gen::inRange(1, 200);
  for (int i = 0; i < steps; ++i) {
    const double change = between(-0.3 * yield, 0.3 * yield);
    const double effort = hysteresis.step(change);
    work += effort * change;
    RC_ASSERT(std::abs(effort) <= bound * (1 + 1e-12));
  }
  // What a closed cycle takes in is lost; along any path the store is never below zero.
  RC_ASSERT(work >= -1e-12);
}

RC_GTEST_PROP(BacklashProperty, NeverTurnsTheStretchAround, ()) {
  const double stretch = between(-1, 1);
  const double passed = through_gap(stretch, between(0, 0.5));
  RC_ASSERT(passed * stretch >= 0.0);
  RC_ASSERT(std::abs(passed) <= std::abs(stretch));
}

}  // namespace
}  // namespace ravencal::physics

namespace ravencal::trajectory {
namespace {

void expect_within_limits(const Trajectory& path) {
  const JointLimits limits = authors_workspace();
  for (std::size_t i = 0; i < path.t_s.size(); ++i) {
    RC_ASSERT((path.joints_ji[i] - limits.low_ji).minCoeff() >= 0.0);
    RC_ASSERT((limits.high_ji - path.joints_ji[i]).minCoeff() >= 0.0);
    if (i > 0) RC_ASSERT(path.t_s[i] > path.t_s[i - 1]);
  }
}

RC_GTEST_PROP(TrajectoryProperty, ZigzagsStayWithinTheLimitsAndTheSpeedLimits, ()) {
  ZigzagOptions options;
  options.kind = static_cast<ZigzagKind>(*rc::gen::inRange(0, 7));
  options.divisions = *rc::gen::inRange(1, 9);
  const Trajectory path = *make_zigzag(options);
  expect_within_limits(path);
  const double deg = std::acos(-1.0) / 180.0;
  const Eigen::Vector3d step_limit = Eigen::Vector3d(2.182 * deg, 3.0 * deg, 0.005) / kSampleRateHz;
  for (std::size_t i = 1; i < path.joints_ji.size(); ++i) {
    const Eigen::Vector3d step = (path.joints_ji[i] - path.joints_ji[i - 1]).cwiseAbs();
    RC_ASSERT((step_limit * (1 + 1e-9) - step).minCoeff() >= 0.0);
  }
}

RC_GTEST_PROP(TrajectoryProperty, RandomMotionStaysWithinTheLimits, ()) {
  RandomOptions options;
  options.mode = *rc::gen::element(RandomMode::kPaper, RandomMode::kCode);
  options.seed = *rc::gen::arbitrary<std::uint64_t>();
  options.duration_s = *rc::gen::inRange(1, 120);
  expect_within_limits(*make_random(options));
}

}  // namespace
}  // namespace ravencal::trajectory
