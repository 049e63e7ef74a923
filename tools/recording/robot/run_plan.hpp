// SPDX-License-Identifier: Apache-2.0
//
// Arguments of `ravencal run`, and what is known without a robot: the trajectory within its limits,
// and its duration.
#pragma once

#include <Eigen/Core>
#include <optional>
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
  std::string crtk_arm;  ///< "arm1", "arm2"; empty: a probe finds it out
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
  /// The CRTK arm that drives the arm, if it was named.
  [[nodiscard]] std::optional<CrtkArm> named_crtk_arm() const;
  /// Those that may be commanded: the named one, else both.
  [[nodiscard]] std::vector<CrtkArm> crtk_arms() const;
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
