// SPDX-License-Identifier: Apache-2.0
//
// Of long recordings, the stretches in which the joints move most. The time of a diagnosis grows
// with its rows, and minutes of motion determine what hours of the same motion do.
#pragma once

#include <string>
#include <vector>

#include "diagnose/track/track.hpp"

namespace ravencal::diagnose {

/// Keeps of tracks that have more rows than a diagnosis fits one stretch from each of equally long
/// parts, so that what drifts is seen from beginning to end. Appends a note that names them.
void keep_moving_stretches(std::vector<Track>& tracks, std::vector<std::string>& notes);

}  // namespace ravencal::diagnose
