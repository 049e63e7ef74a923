// SPDX-License-Identifier: Apache-2.0
//
// Where simulation and recording part, what physics the simulation lacks, and how certain that is.
// Same recordings, plant, options and seed: same report to the last bit, on any number of threads.
#pragma once

#include <vector>

#include "core/result.hpp"
#include "diagnose/explain/explain.hpp"
#include "diagnose/findings/findings.hpp"
#include "physics/plant.hpp"
#include "record/recording.hpp"

namespace ravencal::diagnose {

using Options = ExplainOptions;

/// Diagnoses `training`; figures are on `held_out` recordings and held-out rows, else on the rows
/// that were fitted. Errors: recordings that the plant cannot take, no row to compare (kData);
/// stopped (kUsage).
core::Result<Report> diagnose(const std::vector<record::Recording>& training,
                              const std::vector<record::Recording>& held_out,
                              const physics::Plant& plant, const Options& options);

}  // namespace ravencal::diagnose
