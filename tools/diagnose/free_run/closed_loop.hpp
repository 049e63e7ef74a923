// SPDX-License-Identifier: Apache-2.0
//
// The whole drive on its own: from the first measured state on, the plant's controller follows the
// recorded desired positions and nothing measured comes in any more.
#pragma once

#include <vector>

#include "diagnose/free_run/free_run.hpp"

namespace ravencal::diagnose {

using physics::ServoLaw;

/// The plant's law; whether it feeds the desired velocity forward is taken from `recorded`.
ServoLaw plant_law(const physics::Joint& joint, const ServoLaw& recorded);

/// The law that a recording's own command shows (robust fit to its changes), rows [first, last) of
/// the command series. A servo's gain is a setting of the recording; no position is predicted.
ServoLaw recorded_law(const Series& command, Eigen::Index first, Eigen::Index last);

/// Stretches to run: each recording's held-out rows, or whole recordings where none are held out.
std::vector<FreeRunWindow> closed_loop_stretches(const Series& drive);

/// Errors of position (rad or m) over a stretch.
std::vector<double> closed_loop_errors(const FreeRun& run, const Series& command,
                                       const physics::DriveNumbers<double>& numbers,
                                       const ServoLaw& law, const FreeRunWindow& stretch);

}  // namespace ravencal::diagnose
