// SPDX-License-Identifier: Apache-2.0
//
// Another simulator as the baseline: its recording, aligned by time, takes the place of what the
// plant predicts. The plant then only says what that simulator contains, with which tolerances. An
// inverse simulation has the recorded motion and an effort of its own, a forward simulation the
// recorded command or current and a motion of its own. What is the same in both tells nothing.
#pragma once

#include <vector>

#include "core/result.hpp"
#include "diagnose/findings/findings.hpp"
#include "diagnose/series/series.hpp"
#include "physics/plant.hpp"
#include "record/recording.hpp"

namespace ravencal::diagnose {

/// Shifts the residuals of `set`, built from training and held-out recordings in this order, so
/// that what is left after the plant's prediction is recording minus simulation. `simulated`: one
/// per recording; rows that a simulation does not cover are not looked at. Stages are dropped, each
/// with a note, that a simulation has no signals for, that it repeats, or in which it moves too
/// differently to be compared row by row. Errors (kUsage, kData): other numbers of recordings,
/// another command, no stage to compare, no overlap in time.
core::Status take_simulation_as_baseline(SeriesSet& set,
                                         const std::vector<record::Recording>& training,
                                         const std::vector<record::Recording>& held_out,
                                         const std::vector<record::Recording>& simulated,
                                         const physics::Plant& plant, const SeriesOptions& options);

/// Where a simulation is the baseline: makes relative errors shares of the effort that was measured
/// and traces those of what was measured, whatever the plant says.
void refer_to_measured(const SeriesSet& set, Report& report);

}  // namespace ravencal::diagnose
