// SPDX-License-Identifier: Apache-2.0
//
// How far off each drive ends up on its own: in windows of one second under the recorded effort,
// and over whole stretches under the plant's controller. Both plants run with the numbers that they
// state; nothing is fitted.
#pragma once

#include "diagnose/explain/view.hpp"
#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// Adds `free_run_1s_rmse` of each joint whose effort was recorded and, where both plants have a
/// controller and a desired position was recorded, `closed_loop_rmse` and `closed_loop_mae`.
void add_free_run(const View& view, Report& report);

}  // namespace ravencal::diagnose
