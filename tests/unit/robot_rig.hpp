// SPDX-License-Identifier: Apache-2.0
//
// The follower and the virtual controller face to face, without ROS and without a clock.
#pragma once

#include <functional>
#include <numbers>
#include <optional>
#include <string>

#include "physics/plant.hpp"
#include "physics/raven_arms.hpp"
#include "robot/follower.hpp"
#include "robot/virtual_controller.hpp"

namespace ravencal::test {

inline constexpr double kDeg = std::numbers::pi / 180.0;

/// A path of a few seconds: shoulder and elbow up, insertion out, and back.
inline trajectory::Trajectory short_path() {
  trajectory::Trajectory path;
  const Eigen::Vector3d home(30.0 * kDeg, 90.0 * kDeg, 0.40);
  const Eigen::Vector3d away(4.0 * kDeg, -4.0 * kDeg, -0.006);
  path.t_s = {0.0, 2.0, 4.0};
  path.joints_ji = {home, home + away, home};
  return path;
}

inline physics::Plant raven_plant() {
  return *physics::load_plant(RAVENCAL_SOURCE_DIR "/tools/plants/raven2.toml");
}

/// The shipped plant under a branch of the controller, "main" or "crtk".
inline physics::Plant plant_of_branch(const std::string& branch) {
  physics::Plant plant = raven_plant();
  plant.robot.controller = *physics::find_controller_branch(branch);
  return plant;
}

/// What `ravencal run` makes of a raven_state whose calibrated arm is the one with the encoders.
inline robot::RobotView view_of(const robot::CycleOutput& output) {
  const auto joints = [&](core::RavenField field, bool other) {
    Eigen::Vector3d values;
    for (Eigen::Index i = 0; i < 3; ++i)
      values[i] =
          output.message[core::catalogue_index(field, static_cast<std::size_t>(i), other)] * kDeg;
    return values;
  };
  robot::RobotView view;
  view.stamp_ns = 1'700'000'000'000'000'000 + output.t_ns;
  view.seen_ns = output.t_ns;
  view.runlevel = output.runlevel;
  view.operating = output.operating;
  view.homed = output.homed;
  view.joints_ji = joints(core::RavenField::kJpos, false);
  view.desired_ji = joints(core::RavenField::kJposD, false);
  view.other_joints_ji = joints(core::RavenField::kJpos, true);
  view.other_desired_ji = joints(core::RavenField::kJposD, true);
  return view;
}

inline robot::CrtkArm other_arm(robot::CrtkArm arm) {
  return arm == robot::CrtkArm::kArm1 ? robot::CrtkArm::kArm2 : robot::CrtkArm::kArm1;
}

/// Options of a follower that was told which CRTK arm to command.
inline robot::FollowerOptions told(robot::CrtkArm arm) {
  robot::FollowerOptions options;
  options.crtk_arm = arm;
  return options;
}

/// Runs both until the follower has ended or so many cycles are over. `before_cycle` may press
/// buttons and `change` the view; a command is lost in a cycle in which `arrives` says no.
inline void run_together(robot::VirtualController& robot, robot::Follower& follower, int cycles,
                         const std::function<void(int)>& before_cycle = {},
                         const std::function<void(robot::RobotView&)>& change = {},
                         const std::function<bool(int)>& arrives = {}) {
  for (int i = 0; i < cycles; ++i) {
    if (follower.phase() == robot::Phase::kDone || follower.phase() == robot::Phase::kStopped)
      return;
    if (before_cycle) before_cycle(i);
    robot::RobotView view = view_of(robot.cycle());
    if (change) change(view);
    const auto command = follower.take(view);
    if (command && (!arrives || arrives(i)))
      robot.command(command->arm, robot::CommandKind::kRelative, command->increment_ji);
  }
}

}  // namespace ravencal::test
