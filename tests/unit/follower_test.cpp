// SPDX-License-Identifier: Apache-2.0
//
// The follower against the virtual controller: it arrives, keeps its limits, waits for the pedal,
// and each of its alarms rings.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "unit/robot_rig.hpp"

namespace ravencal::test {
namespace {

using Eigen::Vector3d;
using robot::Button;
using robot::Follower;
using robot::FollowerOptions;
using robot::Phase;
using robot::StopReason;

robot::VirtualController ready_robot(const physics::Plant& plant) {
  robot::VirtualControllerOptions options;
  options.homed = true;
  auto made = robot::VirtualController::create(plant, options);
  EXPECT_TRUE(made.ok());
  made->press(Button::kPedalDown);
  return std::move(made).value();
}

class FollowerOnRobot : public testing::Test {
 protected:
  physics::Plant plant_ = raven_plant();
  robot::VirtualController robot_ = ready_robot(plant_);
  Follower follower_{short_path(), told(robot_.crtk_arm())};
};

TEST_F(FollowerOnRobot, ArrivesWithinTheLimitsOfSpeedAndIncrement) {
  const robot::MotionLimits limits = robot::authors_limits();
  Vector3d last = Vector3d::Zero();
  std::int64_t last_ns = 0;
  Vector3d fastest = Vector3d::Zero();
  for (int i = 0; i < 20'000 && follower_.phase() != Phase::kDone; ++i) {
    const robot::RobotView view = view_of(robot_.cycle());
    const auto command = follower_.take(view);
    ASSERT_NE(follower_.phase(), Phase::kStopped) << follower_.stopped().text;
    if (!command) continue;
    EXPECT_TRUE(
        (command->increment_ji.cwiseAbs().array() <= limits.max_increment_ji.array() + 1e-15)
            .all());
    if (last_ns != 0) {
      const double dt_s = 1e-9 * static_cast<double>(view.stamp_ns - last_ns);
      fastest = fastest.cwiseMax((command->increment_ji / dt_s).cwiseAbs());
    }
    last_ns = view.stamp_ns;
    last = view.joints_ji;
    robot_.command(command->arm, robot::CommandKind::kRelative, command->increment_ji);
  }
  EXPECT_EQ(follower_.phase(), Phase::kDone);
  EXPECT_EQ(follower_.progress(), 1.0);
  EXPECT_TRUE((fastest.array() <= limits.max_speed_ji_per_s.array() * (1.0 + 1e-9)).all())
      << fastest;
  const Vector3d off = (last - short_path().joints_ji.back()).cwiseAbs();
  EXPECT_LT(off[0], 0.3 * kDeg);
  EXPECT_LT(off[1], 0.3 * kDeg);
  EXPECT_LT(off[2], 0.001);
}

TEST_F(FollowerOnRobot, WaitsForThePedalAndGoesOnWhereItWas) {
  double at_pause = 0.0;
  const auto pedal = [&](int cycle) {
    if (cycle == 2000) robot_.press(Button::kPedalUp);
    if (cycle == 2002) at_pause = follower_.progress();
    if (cycle == 4000) {
      EXPECT_EQ(follower_.phase(), Phase::kPaused);
      EXPECT_EQ(follower_.waiting_for(), "the pedal");
      EXPECT_EQ(follower_.progress(), at_pause);
      robot_.press(Button::kPedalDown);
    }
  };
  run_together(robot_, follower_, 30'000, pedal);
  EXPECT_EQ(follower_.phase(), Phase::kDone) << follower_.stopped().text;
  EXPECT_GT(at_pause, 0.1);
  EXPECT_LT(at_pause, 0.9);
  EXPECT_EQ(follower_.pauses(), 1);
}

TEST_F(FollowerOnRobot, SendsNothingBeforeThePedalIsDown) {
  robot_.press(Button::kPedalUp);
  for (int i = 0; i < 500; ++i) EXPECT_FALSE(follower_.take(view_of(robot_.cycle())));
  EXPECT_EQ(follower_.phase(), Phase::kWaiting);
  EXPECT_EQ(follower_.waiting_for(), "the pedal");
}

TEST_F(FollowerOnRobot, StopsForGoodOnEmergencyStop) {
  const auto press = [&](int cycle) {
    if (cycle == 1000) robot_.press(Button::kEmergencyStop);
  };
  run_together(robot_, follower_, 5000, press);
  EXPECT_EQ(follower_.phase(), Phase::kStopped);
  EXPECT_EQ(follower_.stopped().reason, StopReason::kEmergencyStop);
  robot_.press(Button::kEmergencyStopRelease);
  robot_.press(Button::kStart);
  for (int i = 0; i < 2000; ++i) EXPECT_FALSE(follower_.take(view_of(robot_.cycle())));
}

TEST_F(FollowerOnRobot, StopsWhenTheStatesHaveAHole) {
  run_together(robot_, follower_, 500);
  for (int i = 0; i < 250; ++i) (void)robot_.cycle();
  EXPECT_FALSE(follower_.take(view_of(robot_.cycle())));
  EXPECT_EQ(follower_.stopped().reason, StopReason::kStale);
}

TEST_F(FollowerOnRobot, StopsWhenTheRobotFallsSilent) {
  run_together(robot_, follower_, 500);
  follower_.note_silence(0.1);
  EXPECT_EQ(follower_.phase(), Phase::kMoving);
  follower_.note_silence(0.21);
  EXPECT_EQ(follower_.stopped().reason, StopReason::kStale);
}

TEST_F(FollowerOnRobot, StopsWhenStampsRunBackOrJointsAreNoNumbers) {
  Follower other(short_path(), told(robot_.crtk_arm()));
  run_together(robot_, follower_, 200);
  robot::RobotView view = view_of(robot_.cycle());
  view.stamp_ns -= 1'000'000'000;
  EXPECT_FALSE(follower_.take(view));
  EXPECT_EQ(follower_.stopped().reason, StopReason::kStale);

  run_together(robot_, other, 200);
  view = view_of(robot_.cycle());
  view.joints_ji[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(other.take(view));
  EXPECT_EQ(other.phase(), Phase::kStopped);
}

TEST_F(FollowerOnRobot, StopsOnATrackingErrorThatLasts) {
  double held = 0.0;
  run_together(robot_, follower_, 5000, {}, [&](robot::RobotView& view) {
    if (held == 0.0) held = view.joints_ji[1];
    view.joints_ji[1] = held;          // the elbow is stuck
    view.desired_ji[1] = held + 0.04;  // and the controller pushes
  });
  EXPECT_EQ(follower_.stopped().reason, StopReason::kTracking);
  EXPECT_NE(follower_.stopped().text.find("elbow"), std::string::npos) << follower_.stopped().text;
}

TEST_F(FollowerOnRobot, StopsWhenItsCommandsAreIgnored) {
  run_together(robot_, follower_, 8000, {}, {}, [](int) { return false; });
  EXPECT_EQ(follower_.stopped().reason, StopReason::kIgnored);
}

TEST_F(FollowerOnRobot, DoesNotCallCommandsIgnoredThatTheControllerTookBackAfterAHoldUp) {
  // So slow that friction holds the joints until the next hold-up, after which nothing is left.
  trajectory::Trajectory path = short_path();
  path.t_s = {0.0, 90.0, 180.0};
  Follower follower(path, told(robot_.crtk_arm()));
  run_together(robot_, follower, 60'000, {}, {}, [](int cycle) { return cycle % 500 >= 15; });
  EXPECT_EQ(follower.phase(), Phase::kMoving) << follower.stopped().text;
}

TEST_F(FollowerOnRobot, GoesOnAfterASpellInWhichNothingCameThrough) {
  std::optional<robot::RobotView> held;
  const auto freeze = [&](robot::RobotView& view) {
    constexpr std::int64_t kSpellNs = 4'500'000'000;
    if (held && view.stamp_ns - held->stamp_ns > kSpellNs) return;
    if (!held) held = view;
    view.joints_ji = held->joints_ji;
    view.desired_ji = held->desired_ji;
  };
  run_together(robot_, follower_, 9000, {}, freeze);
  EXPECT_EQ(follower_.stopped().reason, StopReason::kNone) << follower_.stopped().text;
}

/// Runs both for a second; then what the robot says in so many cycles is seen at once, after them.
/// Returns how far the commands for that add up to, shoulder or elbow.
double jump_after_hold_up_rad(robot::VirtualController& robot, Follower& follower, int cycles) {
  run_together(robot, follower, 1000);
  std::vector<robot::RobotView> held;
  for (int i = 0; i < cycles; ++i) held.push_back(view_of(robot.cycle()));
  Vector3d sum = Vector3d::Zero();
  std::int64_t seen_ns = held.back().seen_ns;
  for (robot::RobotView& view : held) {
    view.seen_ns = seen_ns += 20'000;  // what it takes to read one
    if (const auto command = follower.take(view)) sum += command->increment_ji;
  }
  return sum.head<2>().cwiseAbs().maxCoeff();
}

TEST_F(FollowerOnRobot, DoesNotJumpWhenStatesThatWereHeldUpComeAtOnce) {
  const double jump_rad = jump_after_hold_up_rad(robot_, follower_, 190);
  EXPECT_EQ(follower_.phase(), Phase::kMoving) << follower_.stopped().text;
  EXPECT_GT(jump_rad, 0.0);
  EXPECT_LT(jump_rad, 0.15 * kDeg);  // a command for each would be 0.4 deg
}

TEST_F(FollowerOnRobot, DoesNotCallCommandsIgnoredThatTheRobotHasNotSeenYet) {
  // Robot time of eleven seconds within one hold-up: a twin that is faster than real time.
  (void)jump_after_hold_up_rad(robot_, follower_, 11'000);
  EXPECT_EQ(follower_.phase(), Phase::kMoving) << follower_.stopped().text;
}

TEST_F(FollowerOnRobot, StopsWhenTheArmIsFarOutsideItsLimits) {
  run_together(robot_, follower_, 100, {},
               [](robot::RobotView& view) { view.joints_ji[2] = 0.55; });
  EXPECT_EQ(follower_.stopped().reason, StopReason::kOutside);
}

TEST_F(FollowerOnRobot, StopsWithinADegreeWhenItWasToldTheOtherArm) {
  Follower follower(short_path(), told(other_arm(robot_.crtk_arm())));
  run_together(robot_, follower, 5000);
  EXPECT_EQ(follower.stopped().reason, StopReason::kOtherArm);
  EXPECT_NE(follower.stopped().text.find("--crtk-arm"), std::string::npos);
  const robot::RobotView view = view_of(robot_.cycle());
  EXPECT_LT(std::abs(view.other_joints_ji[0] - 30.0 * kDeg), 1.2 * kDeg);
  EXPECT_LT(std::abs(view.other_joints_ji[1] - 90.0 * kDeg), 1.2 * kDeg);
}

TEST(ArmProbe, FindsTheArmInBothOrdersOfTheBoardsAndLeavesBothWhereTheyWere) {
  for (const std::string branch : {"main", "crtk"}) {
    for (const std::string arm : {"gold", "green"}) {
      for (const bool green_first : {false, true}) {
        physics::Plant plant = physics::plant_of_arm(plant_of_branch(branch), arm);
        plant.robot.controller.green_arm_first = green_first;
        robot::VirtualController robot = ready_robot(plant);
        Follower follower(short_path(), {});
        const robot::RobotView before = view_of(robot.cycle());
        Vector3d furthest = Vector3d::Zero();
        run_together(robot, follower, 5000, {}, [&](robot::RobotView& view) {
          if (follower.phase() != Phase::kProbing) return;
          furthest = furthest.cwiseMax((view.desired_ji - before.desired_ji).cwiseAbs())
                         .cwiseMax((view.other_desired_ji - before.other_desired_ji).cwiseAbs());
        });
        ASSERT_EQ(follower.phase(), Phase::kMoving) << follower.stopped().text;
        EXPECT_EQ(follower.crtk_arm(), robot.crtk_arm()) << branch << " " << arm << green_first;
        EXPECT_EQ(robot.crtk_arm(),
                  (arm == "green") == green_first ? robot::CrtkArm::kArm1 : robot::CrtkArm::kArm2);
        EXPECT_LT(furthest[1], 0.35 * kDeg) << "no further than announced";
        EXPECT_LT(furthest[0] + furthest[2], 1e-3) << "nothing but the elbow";
      }
    }
  }
}

TEST(ArmProbe, BeginsAgainAfterThePedalAndTriesAgainWhenCommandsWereLost) {
  robot::VirtualController robot = ready_robot(plant_of_branch("crtk"));
  Follower follower(short_path(), {});
  const auto pedal = [&](int cycle) {
    if (cycle == 300) robot.press(Button::kPedalUp);
    if (cycle == 400) {
      EXPECT_EQ(follower.phase(), Phase::kWaiting);
      robot.press(Button::kPedalDown);
    }
  };
  run_together(robot, follower, 8000, pedal, {}, [](int cycle) { return cycle > 2500; });
  ASSERT_NE(follower.phase(), Phase::kStopped) << follower.stopped().text;
  EXPECT_EQ(follower.phase(), Phase::kMoving) << follower.stopped().text;
  EXPECT_EQ(follower.crtk_arm(), robot.crtk_arm());
}

TEST(ArmProbe, IsNotMisledWhenTheControllerGivesUpWhatItHeld) {
  // A hold-up of 15 ms every half second, in which both arms' desired joints change.
  robot::VirtualController robot = ready_robot(plant_of_branch("crtk"));
  const auto arrives = [](int cycle) { return cycle % 500 >= 15; };
  Follower before(short_path(), told(robot.crtk_arm()));
  run_together(robot, before, 20'000, {}, {}, arrives);  // so that servos hold something
  Follower follower(short_path(), {});
  run_together(robot, follower, 9000, {}, {}, arrives);
  EXPECT_EQ(follower.crtk_arm(), robot.crtk_arm()) << follower.stopped().text;
}

TEST(ArmProbe, SaysSoWhenNobodyListens) {
  robot::VirtualController robot = ready_robot(plant_of_branch("crtk"));
  Follower follower(short_path(), {});
  run_together(robot, follower, 20'000, {}, {}, [](int) { return false; });
  EXPECT_EQ(follower.stopped().reason, StopReason::kIgnored);
  EXPECT_NE(follower.stopped().text.find("give --crtk-arm"), std::string::npos)
      << follower.stopped().text;
}

/// Runs with a hold-up of the commands of 15 ms every half second, at which the CRTK branch gives
/// up what both arms' servos held, while the elbow of the other arm creeps at this rate.
Follower run_beside_creep(double creep_deg_per_minute) {
  robot::VirtualController robot = ready_robot(plant_of_branch("crtk"));
  trajectory::Trajectory path = short_path();
  for (std::size_t row = 1; row < 90; ++row) {
    path.t_s.push_back(path.t_s.back() + 2.0);
    path.joints_ji.push_back(path.joints_ji[row]);
  }
  Follower follower(path, told(robot.crtk_arm()));
  std::int64_t start_ns = 0;
  run_together(
      robot, follower, 400'000, {},
      [&](robot::RobotView& view) {
        if (start_ns == 0) start_ns = view.stamp_ns;
        const double minutes = 1e-9 / 60.0 * static_cast<double>(view.stamp_ns - start_ns);
        view.other_joints_ji[1] += creep_deg_per_minute * kDeg * minutes;
      },
      [](int cycle) { return cycle % 500 >= 15; });
  return follower;
}

TEST(IdleArm, MayCreepButMustNotBeLed) {
  const Follower creeping = run_beside_creep(0.3);
  EXPECT_EQ(creeping.phase(), Phase::kDone) << creeping.stopped().text;
  const Follower led = run_beside_creep(1.0);
  EXPECT_EQ(led.stopped().reason, StopReason::kOtherArm);
  EXPECT_LT(led.progress(), 0.5);
}

TEST(IdleArm, MustNotCreepFarInAnyTime) {
  robot::IdleArm idle;
  idle.start(0, Vector3d::Zero());
  double stopped_at_deg = 0.0;
  for (std::int64_t second = 0; second < 3600 && stopped_at_deg == 0.0; ++second) {
    const double elbow = 0.4 * kDeg / 60.0 * static_cast<double>(second);
    if (idle.take(second * 1'000'000'000, {0.0, elbow, 0.0})) stopped_at_deg = elbow / kDeg;
  }
  EXPECT_NEAR(stopped_at_deg, 5.0, 0.1);
}

TEST(MotionLimits, NameTheRowTheJointTheValueAndTheLimit) {
  trajectory::Trajectory path = short_path();
  path.joints_ji[1][1] = 116.0 * kDeg;
  const auto status = robot::check_positions(path, robot::authors_limits(), "t.csv");
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().message,
            "t.csv:3: elbow at 116.00 deg is above its limit of 115.00 deg; nothing was sent");
  path.joints_ji[1][1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(robot::check_positions(path, robot::authors_limits(), "t.csv").ok());
}

TEST(MotionLimits, StretchTimeOnlyWhereAJointIsTooFast) {
  trajectory::Trajectory path = short_path();
  path.t_s = {0.0, 0.1, 10.1};
  const trajectory::Trajectory slow = robot::slowed(path, robot::authors_limits());
  EXPECT_NEAR(slow.t_s[1], 4.0 / 2.182, 1e-9);  // the shoulder's 4 degrees
  EXPECT_NEAR(slow.t_s[2] - slow.t_s[1], 10.0, 1e-9);
  EXPECT_EQ(slow.joints_ji[1], path.joints_ji[1]);
}

}  // namespace
}  // namespace ravencal::test
