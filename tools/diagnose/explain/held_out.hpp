// SPDX-License-Identifier: Apache-2.0
//
// How far the given plant and the improved one are from what was recorded.
#pragma once

#include <cstddef>

#include "diagnose/explain/view.hpp"
#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// One figure per channel that has used rows, commands apart, and the drive's in percent of its
/// effort. `first_recording`: place of the view's first recording in Report::recordings.
void add_held_out(const View& view, std::size_t first_recording, Report& report);

}  // namespace ravencal::diagnose
