// SPDX-License-Identifier: Apache-2.0
//
// Another simulator as the baseline: its recording of the same motion, aligned by time, takes the
// place of what the plant predicts. The plant then only says what that simulator contains, with
// which tolerances.
#pragma once

#include <vector>

#include "core/result.hpp"
#include "diagnose/series/series.hpp"
#include "physics/plant.hpp"
#include "record/recording.hpp"

namespace ravencal::diagnose {

/// Shifts the residuals of `set`, built from training and held-out recordings in this order, so
/// that what is left after the plant's prediction is recording minus simulation. `simulated`: one
/// per recording; rows that a simulation does not cover are not looked at. Stages that a simulation
/// has no signals for are dropped. Errors (kUsage, kData): other numbers of recordings, no stage in
/// common, no overlap in time.
core::Status take_simulation_as_baseline(SeriesSet& set,
                                         const std::vector<record::Recording>& training,
                                         const std::vector<record::Recording>& held_out,
                                         const std::vector<record::Recording>& simulated,
                                         const physics::Plant& plant, const SeriesOptions& options);

}  // namespace ravencal::diagnose
