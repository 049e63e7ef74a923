// SPDX-License-Identifier: Apache-2.0
//
// Where the links of a plant and the bodies of a robot model are while all joints are at zero.
#pragma once

#include <mujoco/mujoco.h>

#include <Eigen/Geometry>
#include <vector>

#include "physics/plant.hpp"

namespace ravencal::physics {

/// Relative, of lengths in metres: what decimals, degrees and principal axes round.
inline constexpr double kSameNumber = 1e-9;

/// Rotations and axes are made units as often as they are read.
bool same_frame(const Frame& one, const Frame& other);

/// In the frame of the carrier.
Eigen::Isometry3d pose_of(const Frame& frame);

/// In the world: [joints], [bodies].
std::vector<Eigen::Isometry3d> link_frames(const Plant& plant);
std::vector<Eigen::Isometry3d> body_frames(const mjModel& model);

}  // namespace ravencal::physics
