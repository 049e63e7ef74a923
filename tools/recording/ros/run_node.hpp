// SPDX-License-Identifier: Apache-2.0
//
// `ravencal run` as a ROS 1 node: checks robot and encoders, waits for homing and pedal, leads the
// arm along the trajectory, and reports how it ended.
#pragma once

#include <functional>

#include "cli/exit_code.hpp"
#include "core/result.hpp"
#include "robot/run_plan.hpp"

namespace ravencal::ros_io {

/// Runs until the trajectory ends, the robot stops or `keep_going` says no. The value is the exit
/// code of a run that came to an end; an error is one that could not begin, or whose recording
/// failed. ros::init must not have been called.
core::Result<cli::ExitCode> run_node(const robot::RunArguments& arguments,
                                     const std::function<bool()>& keep_going);

}  // namespace ravencal::ros_io
