// SPDX-License-Identifier: Apache-2.0
//
// Motions of the suggested recordings, within what the diagnosed recordings showed.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/result.hpp"
#include "diagnose/findings/experiments.hpp"
#include "diagnose/report/suggest.hpp"
#include "physics/plant.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::experiment {

/// Positions and speeds that a motion must not leave, in the plant's order of joints.
struct MotionBounds {
  trajectory::JointLimits range;
  Eigen::Vector3d fastest_ji;  ///< rad/s, rad/s, m/s
};

/// Those that the recordings reached. Errors (kData): the plant has not three joints, or one of
/// them did not move.
core::Result<MotionBounds> bounds_of(const std::vector<diagnose::Explored>& explored,
                                     const physics::Plant& plant);

/// Errors (kUsage): `motion` is kNone.
core::Result<trajectory::Trajectory> motion_of(diagnose::Exercise motion,
                                               const MotionBounds& bounds);

}  // namespace ravencal::experiment
