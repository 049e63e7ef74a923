// SPDX-License-Identifier: Apache-2.0
//
// predict() against the arm that ArmPhysics integrates at 10 kHz: same plant, same motion of the
// motors. The element functions are the same; what differs is that cables balance at every row and
// that links move as the joints would without stretch.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "physics/arm_physics.hpp"
#include "physics/predict/predict.hpp"
#include "physics/predict/run_drive.hpp"
#include "physics/predict/smoother.hpp"
#include "unit/twin_rig.hpp"

namespace ravencal::physics {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kPeriodS = 0.01;  // of a row
constexpr double kLengthS = 30.0;

/// What an arm did under a servo.
struct ArmRun {
  ForcedMotion forced;
  std::vector<VectorXd> effort, position;  // [3]
};

/// Two sines a joint, up to 20 deg/s and 25 deg/s^2.
Vector3d path(double t_s) {
  const auto wave = [&](double phase, double a, double b) {
    return a * std::sin(0.6 * t_s + phase) + b * std::sin(1.7 * t_s + 2.0 * phase);
  };
  return {0.5 + wave(0.3, 0.25, 0.1), 1.5 + wave(1.1, 0.25, 0.1), 0.40 + wave(2.0, 0.03, 0.012)};
}

/// `settled_s`: how long the arm hangs before it is recorded.
ArmRun run_arm(const Plant& plant, double settled_s = 15.0) {
  ArmPhysics arm = std::move(ArmPhysics::create(plant, true)).value();
  core::Random random(1);
  arm.place(path(0.0));
  ArmRun run;
  const auto rows = static_cast<Index>(kLengthS / kPeriodS);
  const int cycles = static_cast<int>(std::lround(kPeriodS * plant.robot.control_rate_hz));
  run.forced.t_s = VectorXd::LinSpaced(rows, 0.0, kPeriodS * static_cast<double>(rows - 1));
  run.forced.fresh.assign(static_cast<std::size_t>(rows), 0);
  run.forced.fresh.front() = 1;
  std::vector<VectorXd> motors(3, VectorXd(rows));
  run.effort.assign(3, VectorXd(rows));
  run.position.assign(3, VectorXd(rows));
  Vector3d start_rad = arm.motors_rad();
  Vector3d last_rad = start_rad;
  const auto before = static_cast<Index>(settled_s / kPeriodS) * cycles;
  for (Index cycle = 0; cycle < before + rows * cycles; ++cycle) {
    const Index i = cycle - before;
    const double t_s = std::max(0.0, static_cast<double>(i) / plant.robot.control_rate_hz);
    Vector3d torque_n_m;
    for (Index j = 0; j < 3; ++j) {
      const Joint& joint = plant.joints[static_cast<std::size_t>(j)];
      // What the motor turns by for the joint alone: coupling is left to the arm.
      const double wanted_rad = start_rad[j] + joint.reduction * (path(t_s)[j] - path(0.0)[j]);
      torque_n_m[j] = joint.controller->kp_n_m_per_rad * (wanted_rad - arm.motors_rad()[j]) -
                      joint.controller->kd_n_m_s_per_rad * plant.robot.control_rate_hz *
                          (arm.motors_rad()[j] - last_rad[j]);
    }
    last_rad = arm.motors_rad();
    if (i >= 0 && i % cycles == 0) {
      for (Index j = 0; j < 3; ++j) {
        const auto n = static_cast<std::size_t>(j);
        const Joint& joint = plant.joints[n];
        motors[n][i / cycles] = arm.motors_rad()[j] / joint.reduction;
        run.effort[n][i / cycles] = torque_n_m[j] * joint.reduction / joint.gearbox_ratio;
        run.position[n][i / cycles] = arm.joints_ji()[j];
      }
    }
    arm.advance(torque_n_m, random);
  }
  for (const VectorXd& motor : motors)
    run.forced.motors.push_back(smooth_motion(run.forced.t_s, motor, run.forced.fresh));
  return run;
}

/// Root mean square after the first seconds, in which friction forgets how the arm hung.
double rms(const VectorXd& x) {
  const Index begun = static_cast<Index>(2.0 / kPeriodS);
  return std::sqrt(x.tail(x.size() - begun).squaredNorm() / static_cast<double>(x.size() - begun));
}

/// The shipped plant without what changes by chance.
Plant steady_plant() {
  Plant plant = shipped_plant();
  for (Joint& joint : plant.joints) {
    for (Effect& effect : joint.effects) {
      effect.parameters.erase("variation");
      effect.parameters.erase("wander");
    }
  }
  return plant;
}

/// The joint without stretch, by the controller's coupling.
VectorXd believed(const Plant& plant, const ArmRun& run, std::size_t j) {
  VectorXd q = run.forced.motors[j].q;
  for (std::size_t k = 0; k < j; ++k) q += plant.coupling[j][k] * believed(plant, run, k);
  return q;
}

TEST(Predict, IsWhatTheSimulatedArmDoes) {
  const Plant plant = steady_plant();
  const ArmRun run = run_arm(plant);
  const auto predicted = predict(plant, run.forced);
  ASSERT_TRUE(predicted.ok()) << predicted.error().message;
  for (std::size_t j = 0; j < 3; ++j) {
    SCOPED_TRACE(plant.joints[j].name);
    const double effort = rms(predicted->effort[j] - run.effort[j]) / rms(run.effort[j]);
    EXPECT_LT(effort, 0.04);
    const double error = rms(run.position[j] - believed(plant, run, j));
    const double position = rms(predicted->position[j] - run.position[j]) / error;
    EXPECT_LT(position, 0.02);
    std::printf("%s: effort %.4f, position %.4f\n", plant.joints[j].name.c_str(), effort, position);
  }
}

struct Case {
  Effect effect;
  std::size_t joint;
  bool in_effort;  // else in the position
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.effect.id << " of joint " << c.joint; }

class PredictEffect : public testing::TestWithParam<Case> {};

/// The plant with the effect, instead of what it has of that name.
Plant with(Plant plant, const Case& c) {
  std::vector<Effect>& effects = plant.joints[c.joint].effects;
  std::erase_if(effects,
                [&](const Effect& e) { return e.id == c.effect.id && e.from == c.effect.from; });
  effects.push_back(c.effect);
  return plant;
}

TEST_P(PredictEffect, IsInThePredictionOfAPlantThatHasIt) {
  const Case& c = GetParam();
  Plant silent = steady_plant();
  // Strands that hold beyond the gap remember on which side the joint was long ago.
  if (c.effect.id == "hysteresis")
    std::erase_if(silent.joints[c.joint].effects,
                  [](const Effect& e) { return e.id == "backlash"; });
  const Plant told = with(silent, c);
  // Warming up begins with the recording.
  const ArmRun run = run_arm(told, c.effect.id == "thermal_drift" ? 0.0 : 15.0);
  const auto off = [&](const Plant& plant) {
    const auto predicted = predict(plant, run.forced);
    EXPECT_TRUE(predicted.ok());
    return c.in_effort ? rms(predicted->effort[c.joint] - run.effort[c.joint])
                       : rms(predicted->position[c.joint] - run.position[c.joint]);
  };
  EXPECT_LT(off(told), 0.5 * off(silent));
}

Case effort_case(const std::string& id, std::size_t joint,
                 std::map<std::string, double, std::less<>> parameters) {
  return {{id, "", std::move(parameters)}, joint, true};
}
Case position_case(const std::string& id, std::size_t joint,
                   std::map<std::string, double, std::less<>> parameters,
                   const std::string& from = "") {
  return {{id, from, std::move(parameters)}, joint, false};
}

INSTANTIATE_TEST_SUITE_P(
    OfThePlant, PredictEffect,
    testing::Values(
        effort_case("coulomb_friction", 0, {{"level", 3.0}}),
        effort_case("viscous_friction", 1, {{"damping", 8.0}}),
        effort_case("stribeck_friction", 0, {{"extra", 1.0}, {"velocity", 0.03}}),
        effort_case("presliding", 1, {{"displacement", 0.02}}),
        effort_case("asymmetric_friction", 0, {{"level_difference", 0.8}}),
        effort_case("asymmetric_friction", 1, {{"damping_difference", 8.0}}),
        effort_case("load_dependent_friction", 1, {{"load_share", 0.3}}),
        effort_case("torque_constant", 0, {{"ratio", 0.15}}),
        effort_case("torque_ripple", 1, {{"amplitude", 0.6}, {"order", 12.0}, {"phase", 0.4}}),
        effort_case("effort_offset", 2, {{"offset", 2.0}}),
        effort_case("eccentricity", 1, {{"amplitude", 0.004}, {"order", 60.0}, {"phase", 1.0}}),
        position_case("gain_error", 0, {{"ratio", 0.02}}),
        position_case("coupling", 2, {{"error", 0.004}}, "shoulder"),
        position_case("backlash", 1, {{"half_width", 0.006}}),
        position_case("hysteresis", 1, {{"stiffness", 800.0}, {"yield", 0.0015}}),
        position_case("creep", 0, {{"compliance", 0.02}, {"time", 4.0}}),
        position_case("eccentricity", 1, {{"amplitude", 0.004}, {"order", 9.0}, {"phase", 1.0}}),
        position_case("thermal_drift", 0, {{"final", 0.01}, {"time", 8.0}})));

/// At rest at these motor positions, which the controller believes to be `at_ji`.
ForcedMotion at_rest(const Plant& plant, const Vector3d& at_ji) {
  constexpr Index kRows = 4;
  ForcedMotion forced;
  forced.t_s = VectorXd::LinSpaced(kRows, 0.0, 0.3);
  forced.fresh = {1, 0, 0, 0};
  const VectorXd still = VectorXd::Zero(kRows);
  for (std::size_t j = 0; j < 3; ++j) {
    double motor = at_ji[static_cast<Index>(j)];
    for (std::size_t k = 0; k < j; ++k)
      motor -= plant.coupling[j][k] * at_ji[static_cast<Index>(k)];
    forced.motors.push_back({VectorXd::Constant(kRows, motor), still, still, 0.0});
  }
  return forced;
}

/// Where the controller takes all joints for at their stops, they are where the encoders have
/// these, whatever ratio and coupling are wrong by.
TEST(Predict, PutsHomedJointsAtTheStopsOfTheEncoders) {
  Plant plant = steady_plant();
  for (Joint& joint : plant.joints) {
    joint.link.mass_kg = 0.0;
    std::erase_if(joint.effects,
                  [](const Effect& e) { return e.id != "gain_error" && e.id != "coupling"; });
  }
  Vector3d stops, shown;
  for (Index j = 0; j < 3; ++j) {
    const physics::Homing& homing = *plant.joints[static_cast<std::size_t>(j)].homing;
    stops[j] = homing.stop_controller_ji;
    shown[j] = homing.stop_encoder_ji;
  }
  ForcedMotion forced = at_rest(plant, stops);
  for (const bool homed : {false, true}) {
    forced.homed = homed;
    const auto predicted = predict(plant, forced);
    ASSERT_TRUE(predicted.ok()) << predicted.error().message;
    double most = 0.0;
    for (std::size_t j = 0; j < 3; ++j)
      most = std::max(most, std::abs(predicted->position[j][3] - shown[static_cast<Index>(j)]));
    if (homed)
      EXPECT_LT(most, 1e-9);
    else
      EXPECT_GT(most, 0.1) << "the stops of controller and encoders differ by 7.5 degrees";
  }
}

/// A pulley turns with its own motor, wherever other joints move the cable, and pulls on it.
TEST(Predict, RunsOutOverTheJointsOwnMotor) {
  Plant plant = steady_plant();
  plant.coupling[1][0] = -0.145;
  // No friction, which would hold the weight beside the cable.
  std::erase_if(plant.joints[1].effects, [](const Effect& e) { return e.id != "compliance"; });
  Plant wavy = plant;
  wavy.joints[1].effects.push_back(
      {"eccentricity", "", {{"amplitude", 0.004}, {"order", 9.0}, {"phase", 1.0}}});
  for (const double shoulder_rad : {0.1, 0.5, 0.9}) {
    const ForcedMotion forced = at_rest(plant, {shoulder_rad, 1.2, 0.4});
    const auto silent = predict(plant, forced);
    const auto told = predict(wavy, forced);
    ASSERT_TRUE(silent.ok() && told.ok());
    const double angle = 9.0 * forced.motors[1].q[3] + 1.0;
    EXPECT_NEAR(told->position[1][3] - silent->position[1][3], 0.004 * std::sin(angle), 2e-4);
    const auto beyond_tension = [](const Prediction& of) {
      return of.effort[1][3] - of.tension[1][3];
    };
    EXPECT_NEAR(beyond_tension(*told) - beyond_tension(*silent),
                0.036 * std::cos(angle) * told->tension[1][3],
                0.05 * 0.036 * std::abs(told->tension[1][3]));
  }
}

TEST(Predict, HoldsAWeightThatNoLinkStates) {
  Plant plant = steady_plant();
  const ForcedMotion forced = at_rest(plant, {0.5, 1.2, 0.4});
  const auto without = predict(plant, forced);
  plant.joints[1].effects.push_back({"gravity", "", {{"amplitude", 2.0}, {"phase", 0.3}}});
  const auto with_it = predict(plant, forced);
  ASSERT_TRUE(without.ok() && with_it.ok());
  EXPECT_NEAR(with_it->effort[1][3] - without->effort[1][3],
              2.0 * std::sin(forced.motors[1].q[3] + 0.3), 1e-9);
  EXPECT_NEAR(with_it->effort[0][3], without->effort[0][3], 1e-12);
}

/// A reading that is stamped late shows where the joint was, in each stretch by itself.
TEST(Predict, ShowsWhereTheJointWasWhereItsEncoderIsLate) {
  constexpr std::size_t kElbow = 1;
  constexpr double kLate_s = 0.013;  // between two rows
  const Plant plant = steady_plant();
  ForcedMotion forced = run_arm(plant).forced;
  const Index middle = forced.t_s.size() / 2;
  forced.fresh[static_cast<std::size_t>(middle)] = 1;
  const auto on_time = predict(plant, forced);
  ASSERT_TRUE(on_time.ok());
  const VectorXd& truth = on_time->position[kElbow];
  forced.truth_lateness_s = kLate_s;
  const auto shown = predict(plant, forced);
  ASSERT_TRUE(shown.ok());
  const double back = kLate_s / (forced.t_s[1] - forced.t_s[0]);
  const auto whole = static_cast<Index>(std::floor(back));
  const double share = back - static_cast<double>(whole);
  for (const Index first : {Index{0}, middle}) {
    EXPECT_EQ(shown->position[kElbow][first], truth[first]);
    const Index row = first + 100;
    EXPECT_NEAR(shown->position[kElbow][row],
                (1.0 - share) * truth[row - whole] + share * truth[row - whole - 1], 1e-9);
  }
  // What a recording says beyond it counts as well, earlier or later.
  std::vector<physics::JointCircumstances> early(plant.joints.size());
  for (physics::JointCircumstances& c : early) c.truth_lateness_s = -kLate_s;
  const physics::Predictor late(plant, forced, physics::Masses::kFixed);
  ForcedMotion stamped_right = forced;
  stamped_right.truth_lateness_s = 0.0;
  const physics::Predictor right(plant, stamped_right, physics::Masses::kFixed);
  EXPECT_EQ(late.predict(plant, early).position[kElbow], right.predict(plant).position[kElbow]);
}

TEST(RunDrive, EndsAtItsLastRowWhateverGapIsBehindIt) {
  RunningDrive drive;
  drive.numbers.inertia = 1.0;
  drive.numbers.presliding = 1e-4;
  const VectorXd none = VectorXd::Zero(3);
  const DriveSignals signals{
      (VectorXd(3) << 0.0, 0.01, 1e10).finished(), none, none, none, VectorXd::Ones(3), none, {}};
  DriveRun ran{none, none, none};
  EXPECT_EQ(run_drive(drive, signals, 0, 2, ran), 2);
  EXPECT_NEAR(ran.velocity[1], 0.01, 1e-9);
}

TEST(Predict, SaysWhichLoadIsMissing) {
  Plant plant = steady_plant();
  plant.joints[1].effects.push_back({"compliance", "push", {{"stretch_per_load", 0.01}}});
  ArmRun run;
  run.forced.t_s = VectorXd::LinSpaced(4, 0.0, 0.3);
  run.forced.fresh = {1, 0, 0, 0};
  run.forced.motors.assign(3, {VectorXd::Zero(4), VectorXd::Zero(4), VectorXd::Zero(4), 0.0});
  const auto predicted = predict(plant, run.forced);
  ASSERT_FALSE(predicted.ok());
  EXPECT_NE(predicted.error().message.find("'push'"), std::string::npos);
}

}  // namespace
}  // namespace ravencal::physics
