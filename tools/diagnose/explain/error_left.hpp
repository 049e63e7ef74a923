// SPDX-License-Identifier: Apache-2.0
//
// What the improved plant leaves of each channel, against what the recordings leave of themselves:
// the alarm for physics that no word of the vocabulary says.
#pragma once

#include "diagnose/explain/view.hpp"
#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// Of every drive and position. The floor is what passes in the same circumstances do not share,
/// else what the sensor resolves, else nothing is known of it.
void add_error_left(const View& view, Report& report);

}  // namespace ravencal::diagnose
