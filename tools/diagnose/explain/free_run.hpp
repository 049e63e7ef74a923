// SPDX-License-Identifier: Apache-2.0
//
// How far off each drive ends up on its own: in windows of several lengths under the recorded
// effort, and over whole stretches under the plant's controller. All plants run with the numbers
// that they state; nothing is fitted.
#pragma once

#include "diagnose/explain/view.hpp"
#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// Adds `free_run_1s_rmse` of each joint whose effort was recorded and, where both plants have a
/// controller and a desired position was recorded, `closed_loop_rmse` and `closed_loop_mae`. Adds
/// the drift over 0.5, 1, 2 and 5 s, where the recording has windows of that length. `refitted`:
/// the given plant with its own numbers refitted.
void add_free_run(const View& view, const physics::Plant& refitted, Report& report);

}  // namespace ravencal::diagnose
