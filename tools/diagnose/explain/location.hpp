// SPDX-License-Identifier: Apache-2.0
//
// Where and when the given plant and the recordings part: in which circumstances, at which
// positions and in which stretches of time.
#pragma once

#include "diagnose/explain/view.hpp"
#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// `view`: of the rows that were fitted, since moments of others are not among what was found. One
/// mismatch for each channel in which an effect or something unexplained stands. What the
/// improved plant cannot hold is located by the whole error of the given one.
void add_mismatch(const View& view, Report& report);

}  // namespace ravencal::diagnose
