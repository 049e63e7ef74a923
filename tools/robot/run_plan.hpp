// SPDX-License-Identifier: Apache-2.0
//
// What `ravencal run` was asked to do, and what of it can be said before a robot is there: the
// trajectory within its limits, and how long it takes.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "robot/follower.hpp"
#include "trajectory/trajectory.hpp"

namespace CLI {
class App;
}

namespace ravencal::robot {

struct RunArguments {
  std::string trajectory;
  std::string out;
  std::string arm = "gold";
  std::string crtk_arm;  ///< "arm1"; empty: arm1 for gold, arm2 for green
  std::string mode = "jr";
  std::vector<double> max_speed = {2.182, 3.0, 5.0};  ///< deg/s, deg/s, mm/s
  double rate_hz = 100.0;
  double stale_s = 0.2;
  double wait_s = 600.0;
  bool no_encoders = false;
  bool dry_run = false;
  bool check = false;
  bool await_homed = false;
  bool force = false;
  bool json = false;

  /// Only looks at the robot, sends nothing.
  [[nodiscard]] bool looks_only() const { return check || await_homed; }
  [[nodiscard]] std::string command_topic() const;  ///< "/arm1/servo_jr"
  [[nodiscard]] std::string arm_topic() const;      ///< "/arm1"
};

/// Options and help of `run`, the same in `ravencal` and in `ravencal-ros`.
void add_run_arguments(CLI::App& command, RunArguments& arguments);

struct RunPlan {
  trajectory::Trajectory trajectory;
  FollowerOptions follower;
  double duration_s = 0.0;  ///< at the limits' speeds, without the way to the start
};

/// Errors: options that do not go together, a trajectory that cannot be read or leaves the limits.
core::Result<RunPlan> make_plan(const RunArguments& arguments);

/// What --dry-run prints.
std::string plan_text(const RunArguments& arguments, const RunPlan& plan);
std::string plan_json(const RunArguments& arguments, const RunPlan& plan);

}  // namespace ravencal::robot
