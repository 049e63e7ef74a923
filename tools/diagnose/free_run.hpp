// SPDX-License-Identifier: Apache-2.0
//
// The judge: the drive of a plant runs free under the recorded effort, from the measured state at
// the start of each window, and is asked where it ends up. Equation error screens and fits; an
// effect that does not help here is statistics only. Cable and motor move as one body.
#pragma once

#include <string>
#include <vector>

#include "diagnose/report.hpp"
#include "diagnose/series.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

inline constexpr double kFreeRunWindow_s = 1.0;

/// Which rows the windows cover.
enum class FreeRunRows { kTraining, kHeldOut };

/// RMS of the position error over all windows (rad or m); negative if no window fits.
double free_run_rmse(const Series& drive, const physics::Plant& plant, FreeRunRows rows);

/// Refits the drive's parameters of `plant` (friction, inertia, weight) of this joint to training
/// windows in free run, within half and double of their values, and returns the plant so refitted;
/// unchanged if windows that the fit did not see are not at least 5 % better for it.
physics::Plant refitted_in_free_run(const Series& drive, const physics::Plant& plant);

}  // namespace ravencal::diagnose
