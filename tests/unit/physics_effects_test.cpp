// SPDX-License-Identifier: Apache-2.0
//
// The defining property of each effect, on its own.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "physics/drive_model.hpp"
#include "physics/drives.hpp"
#include "physics/effects/backlash.hpp"
#include "physics/effects/bristle_friction.hpp"
#include "physics/effects/creep.hpp"
#include "physics/effects/hysteresis.hpp"
#include "physics/effects/quantisation.hpp"
#include "physics/effects/thermal_drift.hpp"
#include "physics/effects/wander.hpp"

namespace ravencal::physics {
namespace {

BristleFriction::Parameters friction_parameters() {
  BristleFriction::Parameters parameters;
  parameters.level = 2.0;
  parameters.presliding = 1e-4;
  return parameters;
}

TEST(BristleFriction, OpposesSlidingWithTheCoulombLevelAtAnySpeed) {
  for (const double velocity : {-0.5, -0.01, 0.01, 0.5}) {
    BristleFriction friction(friction_parameters());
    double effort = 0.0;
    for (int i = 0; i < 10'000; ++i) effort = friction.step(velocity, 1e-4);
    EXPECT_NEAR(effort, std::copysign(2.0, velocity), 1e-3) << velocity;
  }
}

TEST(BristleFriction, HoldsAConstantLoadBelowTheLevelWithoutCreeping) {
  BristleFriction::Parameters parameters = friction_parameters();
  parameters.damping = 50.0;
  BristleFriction friction(parameters);
  double position = 0.0;
  double velocity = 0.0;
  double after_one_second = 0.0;
  for (int i = 0; i < 100'000; ++i) {
    velocity += 1e-4 * (1.5 - friction.step(velocity, 1e-4)) / 0.2;
    position += 1e-4 * velocity;
    if (i == 10'000) after_one_second = position;
  }
  EXPECT_NEAR(position, after_one_second, 1e-6);
  EXPECT_LT(position, 3e-4);  // the blow of the sudden load moves it a few bristle deflections
}

TEST(BristleFriction, LosesItsStribeckExtraWithSpeed) {
  BristleFriction::Parameters parameters = friction_parameters();
  parameters.stribeck_extra = 1.0;
  parameters.stribeck_velocity = 0.01;
  const auto at = [&](double velocity) {
    BristleFriction friction(parameters);
    double effort = 0.0;
    for (int i = 0; i < 100'000; ++i) effort = friction.step(velocity, 1e-4);
    return effort;
  };
  EXPECT_NEAR(at(0.0001), 3.0, 0.01);
  EXPECT_NEAR(at(0.01), 2.5, 0.01);
  EXPECT_NEAR(at(1.0), 2.0, 0.01);
}

TEST(BristleFriction, ActsAsPlayOnAJointBehindASpring) {
  // Drive -> spring k -> joint with friction F: the joint lags by F/k, on the side it came from.
  const double stiffness = 100.0;
  BristleFriction friction(friction_parameters());
  double joint = 0.0;
  double velocity = 0.0;
  const auto drive_to = [&](double from, double to) {
    for (int i = 0; i < 200'000; ++i) {
      const double drive = from + (to - from) * std::min(1.0, i / 150'000.0);
      const double effort =
          stiffness * (drive - joint) - friction.step(velocity, 1e-4) - 4.0 * velocity;
      velocity += 1e-4 * effort / 0.2;
      joint += 1e-4 * velocity;
    }
    return to - joint;
  };
  EXPECT_NEAR(drive_to(0.0, 0.3), +2.0 / stiffness, 1e-3);
  EXPECT_NEAR(drive_to(0.3, 0.1), -2.0 / stiffness, 1e-3);
}

TEST(MotorFriction, OfTheLoadAloneBuildsUpOverTheSameDisplacementAsAnyOther) {
  Joint joint;
  joint.effects.push_back({"load_dependent_friction", "", {{"load_share", 0.4}}});
  WanderingFriction friction = motor_friction(joint);
  const double load_n_m = 0.5;
  double moved_rad = 0.0, effort_n_m = 0.0;
  for (; moved_rad < 5.0 * unstated_presliding(joint); moved_rad += 1e-6)
    effort_n_m = friction.step(1e-3, 1e-3, load_n_m);
  EXPECT_NEAR(effort_n_m, 0.4 * load_n_m, 0.01 * 0.4 * load_n_m);
}

TEST(AsymmetricFriction, TakesItsLevelDifferenceBetweenTheDirections) {
  physics::DriveNumbers<double> n;
  n.level = 2.0;
  n.viscous = 4.0;
  n.asymmetric_level = 0.5 * 0.6;
  for (const double direction : {1.0, -1.0}) {
    physics::DriveState<double> state;
    for (int i = 0; i < 20000; ++i) physics::step_drive(n, direction * 3.0, 0.0, 1e-3, state);
    // Friction is 2.3 forwards and 1.7 backwards.
    const double expected = direction > 0.0 ? (3.0 - 2.3) / 4.0 : -(3.0 - 1.7) / 4.0;
    EXPECT_NEAR(state.velocity, expected, 1e-3);
  }
}

TEST(EffortOffset, IsTakenOffWhatTheDriveIsAskedFor) {
  Joint joint;
  joint.effects = {{"viscous_friction", {}, {{"damping", 4.0}}},
                   {"torque_constant", {}, {{"ratio", 0.25}}},
                   {"effort_offset", {}, {{"offset", 0.8}}}};
  const DriveNumbers<double> n = drive_numbers(joint, 1.0, 1e-4);
  DriveState<double> state;
  for (int i = 0; i < 20000; ++i) step_drive(n, 2.0, 0.0, 1e-3, state);
  EXPECT_NEAR(state.velocity, 1.25 * (2.0 - 0.8) / 4.0, 1e-6);
}

TEST(Backlash, PassesNothingInsideTheGapAndTheRestOutside) {
  EXPECT_EQ(through_gap(0.009, 0.01), 0.0);
  EXPECT_EQ(through_gap(-0.009, 0.01), 0.0);
  EXPECT_NEAR(through_gap(0.015, 0.01), 0.005, 1e-15);
  EXPECT_NEAR(through_gap(-0.015, 0.01), -0.005, 1e-15);
  EXPECT_EQ(through_gap(0.02, 0.0), 0.02);
}

/// Efforts while the stretch visits `targets` in steps of at most `step`.
std::vector<double> follow(Hysteresis& hysteresis, const std::vector<double>& targets,
                           double step) {
  std::vector<double> efforts;
  double at = 0.0;
  for (const double target : targets) {
    double effort = hysteresis.step(0.0);
    while (at != target) {
      const double change = std::clamp(target - at, -step, step);
      at = std::abs(target - at) <= step ? target : at + change;
      effort = hysteresis.step(change);
    }
    efforts.push_back(effort);
  }
  return efforts;
}

TEST(Hysteresis, ClosesItsLoops) {
  Hysteresis hysteresis(100.0, 0.01);
  const auto efforts = follow(hysteresis, {0.02, -0.02, 0.02, -0.02, 0.02}, 1e-4);
  EXPECT_NEAR(efforts[2], efforts[4], 1e-9);
  EXPECT_NEAR(efforts[1], efforts[3], 1e-9);
  EXPECT_NEAR(efforts[2], -efforts[3], 1e-9);
  EXPECT_GT(efforts[2], 0.1);
}

TEST(Hysteresis, DoesNotDependOnSpeed) {
  Hysteresis slow(100.0, 0.01);
  Hysteresis fast(100.0, 0.01);
  const std::vector<double> path = {0.013, -0.004, 0.006, -0.02, 0.001};
  const auto slow_efforts = follow(slow, path, 1e-5);
  const auto fast_efforts = follow(fast, path, 1e-3);
  for (std::size_t i = 0; i < path.size(); ++i) EXPECT_NEAR(slow_efforts[i], fast_efforts[i], 1e-9);
}

TEST(Hysteresis, ReturnsToTheOuterLoopAfterAMinorOne) {
  Hysteresis with_minor_loop(100.0, 0.01);
  Hysteresis without(100.0, 0.01);
  const double a = follow(with_minor_loop, {0.02, -0.02, 0.003, -0.002, 0.003, 0.008}, 1e-5).back();
  const double b = follow(without, {0.02, -0.02, 0.008}, 1e-5).back();
  EXPECT_NEAR(a, b, 1e-9);
}

TEST(Creep, ReachesTwoThirdsOfItsExtensionInOneTimeConstantAndRecovers) {
  Creep creep(0.01, 20.0);
  for (int i = 0; i < 20'000; ++i) creep.step(3.0, 1e-3);
  EXPECT_NEAR(creep.extension(), 0.03 * (1.0 - std::exp(-1.0)), 1e-5);
  for (int i = 0; i < 200'000; ++i) creep.step(0.0, 1e-3);
  EXPECT_NEAR(creep.extension(), 0.0, 1e-5);
}

TEST(ThermalDrift, SaturatesAtItsFinalValue) {
  EXPECT_EQ(thermal_drift(0.004, 5400.0, 0.0), 0.0);
  EXPECT_NEAR(thermal_drift(0.004, 5400.0, 5400.0), 0.004 * 0.632, 1e-5);
  EXPECT_NEAR(thermal_drift(0.004, 5400.0, 1e6), 0.004, 1e-9);
}

TEST(Wander, HasItsDeviationAndForgetsInItsTime) {
  core::Random random(7);
  Wander wander(0.2, 10.0);
  wander.restart(random);
  double sum_squares = 0.0;
  double lagged = 0.0;
  double before = wander.value();
  constexpr int kSteps = 200'000;
  for (int i = 0; i < kSteps; ++i) {  // steps of one time constant
    const double value = wander.step(10.0, random);
    sum_squares += value * value;
    lagged += value * before;
    before = value;
  }
  EXPECT_NEAR(std::sqrt(sum_squares / kSteps), 0.2, 0.004);
  EXPECT_NEAR(lagged / sum_squares, std::exp(-1.0), 0.02);
}

TEST(Quantisation, CountsRoundDownAndTheDacTruncatesTowardsZeroAndClips) {
  EXPECT_EQ(encoder_counts(0.99, 0.1), 9);
  EXPECT_EQ(encoder_counts(-0.01, 0.1), -1);
  // -3695.81 counts per N m: the RAVEN-II's arm motors.
  EXPECT_EQ(dac_counts(0.1, -3695.81, 2500.0), -369.0);
  EXPECT_EQ(dac_counts(-0.1, -3695.81, 2500.0), 369.0);
  EXPECT_EQ(dac_counts(1.0, -3695.81, 2500.0), -2500.0);
}

}  // namespace
}  // namespace ravencal::physics
