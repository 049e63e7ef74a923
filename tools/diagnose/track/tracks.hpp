// SPDX-License-Identifier: Apache-2.0
//
// All recordings of a diagnosis as the model sees them, and what has to be said of them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "diagnose/track/input.hpp"
#include "diagnose/track/track.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

struct Tracks {
  std::vector<Track> training;
  std::vector<Track> held_out;     ///< rows from `held_out_from_s` on, then held-out recordings
  std::vector<std::string> notes;  ///< what was taken for granted or left out; no full stop
};

/// Recordings with too few rows are left out, with a note. Errors: what check_input refuses; no
/// recording with enough rows to fit or to hold out, no joint with two signals to compare (kData).
core::Result<Tracks> make_tracks(const Recordings& training, const Recordings& held_out,
                                 const physics::Plant& plant,
                                 std::optional<double> held_out_from_s);

}  // namespace ravencal::diagnose
