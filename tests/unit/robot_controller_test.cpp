// SPDX-License-Identifier: Apache-2.0
//
// The virtual controller: run levels, homing, clamps of joint commands, the mixture of arms that
// the CRTK branch publishes, and the plugin at its hook.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

#include "physics/raven_twin.hpp"
#include "robot/joint_commands.hpp"
#include "rt/rig.hpp"
#include "unit/robot_rig.hpp"

namespace ravencal::test {
namespace {

using core::RavenField;
using Eigen::Vector3d;
using robot::Button;
using robot::CommandKind;
using robot::CycleOutput;
using robot::JointCommands;
using robot::VirtualController;
using robot::VirtualControllerOptions;

VirtualController make_robot(const VirtualControllerOptions& options,
                             const physics::Plant& plant = raven_plant()) {
  auto made = VirtualController::create(plant, options);
  EXPECT_TRUE(made.ok()) << made.error().message;
  return std::move(made).value();
}

const CycleOutput& run(VirtualController& robot, int cycles) {
  const CycleOutput* last = &robot.cycle();
  for (int i = 1; i < cycles; ++i) last = &robot.cycle();
  return *last;
}

double value(const CycleOutput& output, RavenField field, std::size_t i = 0, bool other = false) {
  return output.message[core::catalogue_index(field, i, other)];
}

TEST(JointCommands, AddUpWithinACycleAndTheirSumIsClamped) {
  JointCommands commands;
  commands.take(CommandKind::kRelative, {0.001, 1.0, -1.0});
  commands.take(CommandKind::kRelative, {0.001, 1.0, -1.0});
  EXPECT_TRUE(commands.pending());
  const Vector3d moved = commands.advance(Vector3d::Zero(), 1e-3);
  EXPECT_NEAR(moved[0], 0.002, 1e-15);
  EXPECT_NEAR(moved[1], 0.0025, 1e-15);
  EXPECT_NEAR(moved[2], -5e-5, 1e-15);
  EXPECT_FALSE(commands.pending());
  EXPECT_EQ(commands.advance(moved, 1e-3), moved) << "taken commands are forgotten";
  // Opposite commands cancel before the clamp, not after it.
  commands.take(CommandKind::kRelative, {0.004, 0.0, 0.0});
  commands.take(CommandKind::kRelative, {-0.003, 0.0, 0.0});
  EXPECT_NEAR(commands.advance(Vector3d::Zero(), 1e-3)[0], 0.001, 1e-15);
}

TEST(JointCommands, OfSeveralKindsIncrementsComeBeforePositionsBeforeVelocities) {
  JointCommands commands;
  commands.take(CommandKind::kVelocity, {1.0, 0.0, 0.0});
  commands.take(CommandKind::kAbsolute, {0.0, 0.002, 0.0});
  EXPECT_TRUE(commands.advance(Vector3d::Zero(), 1e-3).isApprox(Vector3d(0.0, 0.002, 0.0)));
  commands.take(CommandKind::kAbsolute, {0.0, 0.002, 0.0});
  commands.take(CommandKind::kRelative, {0.0, 0.0, 1e-5});
  EXPECT_TRUE(commands.advance(Vector3d::Zero(), 1e-3).isApprox(Vector3d(0.0, 0.0, 1e-5)));
}

TEST(JointCommands, AnAbsolutePositionIsApproachedByTheClampAtMost) {
  JointCommands commands;
  commands.take(CommandKind::kAbsolute, {1.0, 0.001, 1.0});
  EXPECT_TRUE(commands.advance(Vector3d::Zero(), 1e-3).isApprox(Vector3d(0.0025, 0.001, 5e-5)));
}

TEST(JointCommands, WhatIsNoNumberIsDropped) {
  JointCommands commands;
  commands.take(CommandKind::kRelative, {std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0});
  commands.take(CommandKind::kAbsolute, {0.0, std::numeric_limits<double>::infinity(), 0.0});
  EXPECT_EQ(commands.advance(Vector3d::Ones(), 1e-3), Vector3d::Ones());
}

TEST(VirtualController, GoesThroughTheRunLevelsAsPeoplePress) {
  VirtualController robot = make_robot({});
  EXPECT_EQ(run(robot, 10).runlevel, robot::kEmergencyStop);
  robot.press(Button::kEmergencyStopRelease);
  EXPECT_EQ(run(robot, 10).runlevel, robot::kEmergencyStop) << "the silver button starts it";
  robot.press(Button::kStart);
  const CycleOutput& homing = run(robot, 10);
  EXPECT_EQ(homing.runlevel, robot::kInit);
  EXPECT_TRUE(homing.busy);
  EXPECT_FALSE(homing.homed);
  EXPECT_EQ(value(homing, RavenField::kSublevel), 0.0);
  EXPECT_NE(value(run(robot, 500), RavenField::kDac), 0.0) << "it moves towards the hard stops";
  const CycleOutput& homed = run(robot, 30'000);
  EXPECT_EQ(homed.runlevel, robot::kPedalUp);
  EXPECT_TRUE(homed.homed);
  EXPECT_EQ(value(homed, RavenField::kSublevel), 1.0);
  EXPECT_NEAR(value(homed, RavenField::kJpos, 1), 90.0, 2.0);
  robot.press(Button::kPedalDown);
  EXPECT_EQ(run(robot, 2).runlevel, robot::kPedalDown);
  robot.press(Button::kEmergencyStop);
  EXPECT_EQ(run(robot, 2).operating, robot::OperatingState::kDisabled);
  // A homed robot does not home again, unless it is told to.
  robot.press(Button::kEmergencyStopRelease);
  robot.press(Button::kStart);
  EXPECT_EQ(run(robot, 1000).runlevel, robot::kPedalDown);
  const double offset = value(run(robot, 1), RavenField::kEncOffsets);
  robot.press(Button::kUnhome);
  run(robot, 5);
  robot.press(Button::kEmergencyStopRelease);
  robot.press(Button::kStart);
  const CycleOutput& again = run(robot, 30'000);
  EXPECT_TRUE(again.homed);
  EXPECT_NE(value(again, RavenField::kEncOffsets), offset) << "every homing seats differently";
}

TEST(VirtualController, HomesAsTheTwinDoesByItself) {
  auto twin = physics::RavenTwin::create(plant_of_branch("crtk"), 1);
  ASSERT_TRUE(twin.ok());
  twin->home();
  VirtualController robot = make_robot({});
  robot.press(Button::kEmergencyStopRelease);
  robot.press(Button::kStart);
  const CycleOutput& homed = run(robot, 30'000);
  const auto& alone = twin->begin_cycle();
  for (std::size_t joint = 0; joint < 3; ++joint) {
    EXPECT_EQ(value(homed, RavenField::kEncOffsets, joint),
              alone[core::catalogue_index(RavenField::kEncOffsets, joint)]);
  }
}

TEST(VirtualController, HoldsStillWithItsBrakesOn) {
  VirtualControllerOptions options;
  options.homed = true;
  VirtualController robot = make_robot(options);
  const double before = value(run(robot, 3), RavenField::kMpos, 1);
  robot.command(robot.crtk_arm(), CommandKind::kRelative, {0.002, 0.002, 0.0});
  const CycleOutput& later = run(robot, 3000);
  EXPECT_EQ(value(later, RavenField::kMpos, 1), before);
  EXPECT_NE(value(later, RavenField::kDac, 1), 0.0) << "the weight is fed with the pedal up";
  robot.press(Button::kEmergencyStop);
  EXPECT_EQ(value(run(robot, 2), RavenField::kDac, 1), 0.0);
}

TEST(VirtualController, PublishesPosesAndTypesByMechanismAndJointsByArm) {
  VirtualControllerOptions options;
  options.homed = true;
  for (const std::string branch : {"main", "crtk"}) {
    VirtualController robot = make_robot(options, plant_of_branch(branch));
    const CycleOutput& output = run(robot, 5);
    // With the serial numbers of the sources mech[0] is gold on main and green on crtk.
    const bool crossed = branch == "crtk";
    const double gold_type = crossed ? 0.0 : 49.0;
    const double green_type = crossed ? 1.0 : 22.0;
    EXPECT_EQ(value(output, RavenField::kType), crossed ? green_type : gold_type) << branch;
    EXPECT_EQ(value(output, RavenField::kType, 0, true), crossed ? gold_type : green_type);
    EXPECT_EQ(value(output, RavenField::kSublevel), crossed ? 1.0 : 3.0);
    physics::SlotVector joints{};
    for (std::size_t slot = 0; slot < core::kSlotCount; ++slot)
      joints[slot] = value(output, RavenField::kJpos, slot) * kDeg;
    const auto pose = physics::forward_kinematics(physics::Arm::kGold, joints);
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(value(output, RavenField::kPos, i, crossed), pose.position_um[i], 1.0) << branch;
  }
}

TEST(VirtualController, CommandsOfArm1MoveTheArmWhoseBoardComesFirst) {
  VirtualControllerOptions options;
  options.homed = true;
  for (const bool green_first : {false, true}) {
    physics::Plant plant = plant_of_branch("crtk");
    plant.robot.controller.green_arm_first = green_first;
    VirtualController robot = make_robot(options, plant);
    robot.press(Button::kPedalDown);
    const CycleOutput before = run(robot, 2);
    for (int i = 0; i < 1000; ++i) {
      robot.command(robot::CrtkArm::kArm1, CommandKind::kRelative, {3e-5, 3e-5, 0.0});
      robot.cycle();
    }
    const CycleOutput& after = run(robot, 1);
    const auto moved_deg = [&](bool green) {
      return value(after, RavenField::kJpos, 1, green) - value(before, RavenField::kJpos, 1, green);
    };
    EXPECT_NEAR(moved_deg(green_first), 0.03 / kDeg, 0.6);
    EXPECT_NEAR(moved_deg(!green_first), 0.0, 0.3);
  }
}

/// Desired minus measured elbow of both arms, deg: what friction and weight leave of the commands.
std::array<double, 2> elbows_apart_deg(const CycleOutput& output) {
  return {value(output, RavenField::kJposD, 1) - value(output, RavenField::kJpos, 1),
          value(output, RavenField::kJposD, 1, true) - value(output, RavenField::kJpos, 1, true)};
}

/// Moves both arms' desired elbows by 0.3 deg, which friction does not follow, and then waits.
std::array<std::array<double, 2>, 2> elbows_apart_after(const std::string& branch, int cycles) {
  VirtualControllerOptions options;
  options.homed = true;
  VirtualController robot = make_robot(options, plant_of_branch(branch));
  robot.press(Button::kPedalDown);
  run(robot, 100);
  for (int i = 0; i < 20; ++i) {
    robot.command(robot::CrtkArm::kArm1, CommandKind::kRelative, {0.0, 2.6e-4, 0.0});
    robot.command(robot::CrtkArm::kArm2, CommandKind::kRelative, {0.0, 2.6e-4, 0.0});
    robot.cycle();
  }
  const std::array<double, 2> before = elbows_apart_deg(robot.cycle());
  return {before, elbows_apart_deg(run(robot, cycles - 1))};
}

TEST(VirtualController, SetsBothArmsDesiredJointsToMeasuredOnesTenCyclesAfterTheLastCommand) {
  for (const std::size_t arm : {0U, 1U}) {
    const auto within = elbows_apart_after("crtk", 10);
    ASSERT_GT(within[0][arm], 0.15) << "the motors have not moved that far yet";
    EXPECT_GT(within[1][arm], 0.1) << "ten cycles without a command still hold";
    const auto beyond = elbows_apart_after("crtk", 11);
    EXPECT_LT(std::abs(beyond[1][arm]), 0.1) << "the eleventh gives up what was commanded";
    const auto on_main = elbows_apart_after("main", 11);
    EXPECT_GT(on_main[1][arm], 0.1) << "main has no joint commands to leave";
  }
}

TEST(VirtualController, TheGreenArmMovesTheSameWayWithMirroredSigns) {
  VirtualControllerOptions options;
  options.homed = true;
  VirtualController robot = make_robot(options, physics::plant_of_arm(raven_plant(), "green"));
  EXPECT_FALSE(robot.gold());
  robot.press(Button::kPedalDown);
  run(robot, 2);
  for (int i = 0; i < 1000; ++i) {
    robot.command(robot.crtk_arm(), CommandKind::kRelative, {3e-5, 3e-5, 0.0});
    robot.cycle();
  }
  EXPECT_NEAR(value(run(robot, 200), RavenField::kJpos), 30.0 + 0.03 / kDeg, 0.6);
}

/// A correction of about (1.1 deg, -2.9 deg, 3 mm), whatever the inputs.
class CorrectedRobot : public testing::Test {
 protected:
  CorrectedRobot() {
    model::CalibrationModel model =
        make_model({plain("jpos.shoulder"), plain("jpos.elbow"), plain("jpos.insertion")}, {});
    model.layers[0].weights.setZero();
    model.layers[0].biases.setZero();
    model.input.mean = Vector3d(0.6, 1.5, 0.38);
    model.input.scale = Vector3d(0.6, 0.8, 0.1);
    model.input_min = model.input.mean - model.input.scale;
    model.input_max = model.input.mean + model.input.scale;
    model.origin.arm = model::Arm::kGold;
    options_.homed = true;
    options_.plugin = RAVENCAL_PLUGIN_PATH;
    options_.weights = write_weights(model, "robot.blob").string();
  }
  VirtualControllerOptions options_;
};

TEST_F(CorrectedRobot, PublishesCorrectedJointsAndItsMotorsDoNotJump) {
  VirtualControllerOptions plain_options = options_;
  plain_options.plugin.clear();
  plain_options.weights.clear();
  VirtualController plain_robot = make_robot(plain_options);
  VirtualController robot = make_robot(options_);
  const CycleOutput& raw = run(plain_robot, 6000);
  const CycleOutput& corrected = run(robot, 6000);
  EXPECT_NEAR(corrected.correction_ji[1], -0.05, 1e-4);
  EXPECT_NEAR(value(corrected, RavenField::kJpos, 1) - value(raw, RavenField::kJpos, 1),
              -0.05 / kDeg, 0.01);
  EXPECT_EQ(value(corrected, RavenField::kMpos, 1), value(raw, RavenField::kMpos, 1));
  robot.press(Button::kPedalDown);
  for (int i = 0; i < 500; ++i) {
    const CycleOutput& output = robot.cycle();
    const double apart = value(output, RavenField::kMposD, 1) - value(output, RavenField::kMpos, 1);
    ASSERT_LT(std::abs(apart), 60.0)
        << "cycle " << i;  // friction holds it; a jump would be 350 deg
  }
}

TEST_F(CorrectedRobot, RefusesWeightsOfTheOtherArm) {
  physics::Plant green = raven_plant();
  green.robot.arm = "green";
  const auto robot = VirtualController::create(green, options_);
  ASSERT_FALSE(robot.ok());
  EXPECT_NE(robot.error().message.find("was trained for the gold arm and would correct the green"),
            std::string::npos)
      << robot.error().message;
}

TEST_F(CorrectedRobot, RefusesWeightsAndPluginsThatAreNotThere) {
  VirtualControllerOptions options = options_;
  options.weights = "/nonexistent.blob";
  EXPECT_FALSE(VirtualController::create(raven_plant(), options).ok());
  options = options_;
  options.plugin = "/nonexistent.so";
  EXPECT_FALSE(VirtualController::create(raven_plant(), options).ok());
}

}  // namespace
}  // namespace ravencal::test
