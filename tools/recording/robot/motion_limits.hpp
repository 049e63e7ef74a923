// SPDX-License-Identifier: Apache-2.0
//
// How far and how fast a RAVEN-II may be led through CRTK joint commands, and what that makes of a
// trajectory. Knows no ROS. Joints 1 to 3: rad, rad, m.
#pragma once

#include <Eigen/Core>
#include <string>

#include "core/result.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::robot {

struct MotionLimits {
  Eigen::Vector3d low_ji;
  Eigen::Vector3d high_ji;
  Eigen::Vector3d max_speed_ji_per_s;
  Eigen::Vector3d max_increment_ji;  ///< per message; the controller clamps what is larger
};

/// Positions and speeds of the authors' follower (HaonanPeng/raven2_CRTK_Python_controller,
/// run_r2_trajectory_follow.py): 15 to 70 deg, 50 to 115 deg, 0.32 to 0.43 m; 2.182 deg/s, 3 deg/s,
/// 5 mm/s. Increments: uw-biorobotics/raven2 branch crtk, update_device_state.cpp.
MotionLimits authors_limits();

/// Error if a row of `trajectory` is outside the positions; it names the row as a line of `source`,
/// the joint, its value and the limit.
core::Status check_positions(const trajectory::Trajectory& trajectory, const MotionLimits& limits,
                             const std::string& source);

/// The same path, stretched in time where a joint would move faster than its limit.
trajectory::Trajectory slowed(const trajectory::Trajectory& trajectory, const MotionLimits& limits);

/// "27.3 deg", "0.371 m": as people read joint `joint`.
std::string joint_text(Eigen::Index joint, double value_ji);

}  // namespace ravencal::robot
