// SPDX-License-Identifier: Apache-2.0
//
// Recordings of a plant's simulation over the whole workspace and under several loads, for a
// network to learn before it sees the robot.
#pragma once

#include <vector>

#include "core/result.hpp"
#include "physics/plant.hpp"
#include "record/recording.hpp"
#include "simulation/session.hpp"

namespace ravencal::simulation {

/// One recording per load (0, 250, 500 g at the tool carriage), random motion, rows `row_period_s`
/// apart, one session without re-homing. Errors: stopped by `progress` (kUsage), or those of the
/// twin.
core::Result<std::vector<record::Recording>> simulated_over_workspace(
    const physics::Plant& plant, double row_period_s, const ProgressFunction& progress);

}  // namespace ravencal::simulation
