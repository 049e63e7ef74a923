// SPDX-License-Identifier: Apache-2.0
//
// What counts in the control loop is the motor command, which must never step further than without
// the plugin; and it does when the inverse is left out.
#include <gtest/gtest.h>

#include <cstdio>
#include <functional>
#include <ostream>

#include "rt/controlled_twin.hpp"

namespace ravencal::test {
namespace {

/// Answers to the motor torque with more than the servo's stiffness gives back: the loop through
/// correction, motor command and torque has a gain above 1. 136 times 0.3 N m per rad of the motor
/// is 41 N m per rad of joint 1.
model::CalibrationModel make_unstable_loop() {
  model::CalibrationModel model =
      make_model({plain("tau.shoulder"), plain("tau.elbow"), plain("tau.insertion")}, {});
  model.input.mean.setZero();
  model.input.scale.setOnes();
  model.input_min.setConstant(-20.0);
  model.input_max.setConstant(20.0);
  model.layers[0].weights = -Eigen::Matrix3f::Identity();
  model.layers[0].biases.setZero();
  model.output.mean.setZero();
  model.output.scale = Vector3d(0.05, 0.05, 0.003);
  model.row_period_s = 0.001;
  return model;
}

struct Outcome {
  Vector3d largest_steps_rad;
  double furthest_seed_rad;
};

/// Pedal down and up at every phase of the motion, E-stop, homing again, pedal once more.
Outcome work(Plugin plugin) {
  ControlledTwin robot(plugin);
  const auto use_pedal = [&] {
    robot.run(kPedalUp, 1000);  // the correction fades in
    robot.run(kPedalDown, 4000);
    for (int i = 0; i < 12; ++i) {
      robot.run(kPedalUp, 150);
      robot.run(kPedalDown, 370 + 110 * (i % 5));
    }
  };
  use_pedal();
  if (plugin == Plugin::kBothWays) {
    EXPECT_TRUE(robot.state() == RAVENCAL_STATE_ACTIVE ||
                robot.state() == RAVENCAL_STATE_FADING_IN);
    EXPECT_GT(std::abs(robot.correction_ji(1)), 0.1);
  }
  robot.run(kEmergencyStop, 500);  // fading out
  robot.run(kPedalUp, 300);        // and in again
  robot.run(kPedalDown, 1500);
  robot.run(kEmergencyStop, 4000);
  EXPECT_EQ(robot.correction_ji(1), 0.0);
  robot.home();
  use_pedal();
  EXPECT_EQ(robot.wrong(), "");
  return {robot.largest_steps_rad(), robot.furthest_seed_rad()};
}

TEST(ControlPair, NeverStepsTheMotorCommandFurtherThanWithoutThePlugin) {
  const Outcome without = work(Plugin::kNone);
  const Outcome with = work(Plugin::kBothWays);
  const Outcome forward_only = work(Plugin::kForwardOnly);
  for (int j = 0; j < 3; ++j) {
    std::printf(
        "motor %d: largest step %.3f rad without the plugin, %.3f with it, %.3f without "
        "its inverse\n",
        j + 1, without.largest_steps_rad[j], with.largest_steps_rad[j],
        forward_only.largest_steps_rad[j]);
    // The steps are the tracking errors that friction and weight had built up when the pedal
    // moved. Runs whose arms are not at the same place at the same time differ by a few per cent.
    EXPECT_LE(with.largest_steps_rad[j], 1.05 * without.largest_steps_rad[j]);
    EXPECT_GT(forward_only.largest_steps_rad[j], 2.0 * without.largest_steps_rad[j]);
  }
  // In the same state of the robot, exactly: the command becomes where the motor is.
  EXPECT_LT(without.furthest_seed_rad, kCountRad);
  EXPECT_LT(with.furthest_seed_rad, kCountRad);
  EXPECT_GT(forward_only.furthest_seed_rad, 1000.0 * kCountRad);
}

/// What may befall a correction while the pedal is down.
struct Transition {
  std::string name;
  std::function<void(ControlledTwin&)> act;
  bool moves;            ///< the correction goes on to another value with the operator's motion
  int up_cycles = 1000;  ///< with the pedal up before; fewer: the press comes in a fade
};

void PrintTo(const Transition& transition, std::ostream* out) { *out << transition.name; }

model::CalibrationModel make_other_correction() {
  model::CalibrationModel model = make_large_correction();
  model.output.mean = Vector3d(-0.01, -0.06, 0.004);
  return model;
}

/// The same, trained on a part of the motion only: its confidence changes with the joints.
model::CalibrationModel make_narrow_correction() {
  model::CalibrationModel model = make_large_correction();
  model.input_min[0] = 0.51;
  model.input_max[0] = 0.53;
  return model;
}

const std::vector<Transition> kTransitions = {
    {"fade", [](ControlledTwin&) {}, true, 200},
    {"disabled", [](ControlledTwin& robot) { robot.rig().enable(false); }, false},
    {"disabled_and_enabled",
     [](ControlledTwin& robot) {
       robot.rig().enable(false);
       robot.run(kPedalDown, 700);
       robot.rig().enable();
     },
     true},
    {"new_weights", [](ControlledTwin& robot) { robot.rig().load(make_other_correction()); }, true},
    {"confidence", [](ControlledTwin& robot) { robot.rig().load(make_narrow_correction()); },
     false},
    {"rollback",
     [](ControlledTwin& robot) {
       robot.rig().load(make_model_with_a_flaw());
       robot.run(kPedalDown, 100);
       robot.provoke();
       EXPECT_EQ(robot.rig().instance.counters().rollbacks, 1U);
     },
     false},
    {"reset",
     [](ControlledTwin& robot) {
       robot.rig().api().reset(robot.rig().instance.get());
       robot.run(kPedalDown, 100);
       robot.rig().enable();
     },
     false},
};

class PedalDownTransition : public testing::TestWithParam<Transition> {};

TEST_P(PedalDownTransition, InMotionAddsAtMostOneCountPerCycle) {
  ControlledTwin robot(Plugin::kBothWays);
  robot.run(kPedalUp, GetParam().up_cycles);
  robot.run(kPedalDown, 2000);
  ASSERT_GT(std::abs(robot.correction_ji(1)), 0.01);
  robot.forget_added();
  GetParam().act(robot);
  robot.run(kPedalDown, 4000);
  std::printf("at most %.3f counts in a cycle, %.1f in all\n", robot.most_added_counts(),
              robot.added_counts());
  EXPECT_LE(robot.most_added_counts(), 1.0);
  if (GetParam().moves) {
    EXPECT_GT(robot.added_counts(), 100.0);
  }
}

TEST_P(PedalDownTransition, AtStandstillMovesNoTrueJoint) {
  const auto moved = [](Plugin plugin, const std::function<void(ControlledTwin&)>& act) {
    ControlledTwin robot(plugin);
    robot.run(kPedalUp, GetParam().up_cycles);
    robot.let_go();
    robot.run(kPedalDown, 2000);
    const Vector3d before = robot.truth_ji();
    act(robot);
    Vector3d most = Vector3d::Zero();
    for (int i = 0; i < 40; ++i) {
      robot.run(kPedalDown, 100);
      most = most.cwiseMax((robot.truth_ji() - before).cwiseAbs());
    }
    return most;
  };
  const Vector3d beyond =
      moved(Plugin::kBothWays, GetParam().act) - moved(Plugin::kNone, [](ControlledTwin&) {});
  EXPECT_LT(beyond[0], 0.02 * kDeg);
  EXPECT_LT(beyond[1], 0.02 * kDeg);
  EXPECT_LT(beyond[2], 0.02e-3);
}

INSTANTIATE_TEST_SUITE_P(Kinds, PedalDownTransition, testing::ValuesIn(kTransitions),
                         [](const auto& transition) { return transition.param.name; });

TEST(UnstableLoop, MovesNoJointThatNobodyCommands) {
  const auto moved_at_standstill = [](Plugin plugin) {
    ControlledTwin robot(plugin, make_unstable_loop());
    robot.run(kPedalUp, 1500);
    robot.stand(2000);
    const Vector3d before = robot.truth_ji();
    Vector3d moved = Vector3d::Zero();
    for (int i = 0; i < 100; ++i) {
      robot.stand(100);
      moved = moved.cwiseMax((robot.truth_ji() - before).cwiseAbs());
    }
    return moved;
  };
  const Vector3d beyond =
      (moved_at_standstill(Plugin::kBothWays) - moved_at_standstill(Plugin::kNone));
  EXPECT_LT(beyond[0], 0.02 * kDeg);
  EXPECT_LT(beyond[1], 0.02 * kDeg);
  EXPECT_LT(beyond[2], 0.02e-3);
}

TEST(UnstableLoop, MakesNoTrueJointMuchFasterThanItIsCommandedToBe) {
  const auto peaks = [](Plugin plugin, float follow_share) {
    ControlledTwin robot(plugin, make_unstable_loop(), follow_share);
    robot.run(kPedalUp, 1500);
    robot.run(kPedalDown, 3000);
    robot.forget_speeds();
    robot.run(kPedalDown, 20000);
    return std::pair(robot.peak_true_ji_per_s(), robot.peak_commanded_ji_per_s());
  };
  const Vector3d without = peaks(Plugin::kNone, kFollowShare).first;
  const auto [with, commanded] = peaks(Plugin::kBothWays, kFollowShare);
  // The same weights where the correction may move as fast as the command.
  const Vector3d unlimited = peaks(Plugin::kBothWays, 1.0F).first;
  for (int j = 0; j < 3; ++j) {
    const double allowed = 1.2 * std::max(without[j], commanded[j]);
    std::printf("joint %d: peak true speed %.4g, %.4g without, %.4g unlimited; commanded %.4g\n",
                j + 1, with[j], without[j], unlimited[j], commanded[j]);
    EXPECT_LE(with[j], allowed) << "joint " << j + 1;
  }
  EXPECT_GT(unlimited[0], 1.2 * std::max(without[0], commanded[0])) << "what the limit is for";
}

}  // namespace
}  // namespace ravencal::test
