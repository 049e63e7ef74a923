// SPDX-License-Identifier: Apache-2.0
//
// The virtual RAVEN as a ROS 1 node: the joint topics that the controller of the CRTK branch
// publishes and subscribes to, the external encoders, and services for the operator's buttons and
// pedal. The control loop runs in RobotLoop's thread; ROS has its own.
#pragma once

#include <functional>

#include "core/result.hpp"
#include "robot/robot_arguments.hpp"

namespace ravencal::ros_io {

/// Runs until `keep_going` says no or the time is over. ros::init must not have been called.
core::Status run_robot_node(const robot::RobotArguments& arguments,
                            const std::function<bool()>& keep_going);

}  // namespace ravencal::ros_io
