// SPDX-License-Identifier: Apache-2.0
//
// Motions of the suggested recordings, within what the diagnosed recordings showed.
#pragma once

#include <vector>

#include "core/result.hpp"
#include "diagnose/findings/experiments.hpp"
#include "diagnose/report/suggest.hpp"
#include "physics/plant.hpp"
#include "trajectory/trajectory.hpp"

namespace ravencal::experiment {

/// Positions and speeds that the recordings reached, as far as the plant's own limits allow them,
/// in the plant's order of joints. Errors (kData): a joint did not move, or only beyond its limits.
core::Result<trajectory::JointLimits> bounds_of(const std::vector<diagnose::Explored>& explored,
                                                const physics::Plant& plant);

/// Errors (kUsage): `motion` is kNone.
core::Result<trajectory::Trajectory> motion_of(diagnose::Exercise motion,
                                               const trajectory::JointLimits& bounds);

}  // namespace ravencal::experiment
