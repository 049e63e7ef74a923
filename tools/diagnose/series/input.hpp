// SPDX-License-Identifier: Apache-2.0
//
// What must be said of the series: nothing is left out in silence.
#pragma once

#include <string>
#include <vector>

#include "diagnose/series/series.hpp"
#include "diagnose/track/input.hpp"

namespace ravencal::diagnose {

/// Recordings that have nothing to say of a series, and signals of the plant's effects that none
/// has.
std::vector<std::string> series_notes(const SeriesSet& set, const Recordings& training,
                                      const Recordings& held_out, const physics::Plant& plant);

}  // namespace ravencal::diagnose
