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

// Another simulator as the baseline: what it says takes the place of what the plant predicts. The
// plant then only says what that simulator contains, with which tolerances. An inverse simulation
// has the recorded motion and an effort of its own, a forward simulation the recorded command or
// effort and a motion of its own. What is the same in both tells nothing.

/// Shifts efforts and positions of `tracks`, made of these recordings, so that what the given plant
/// leaves of them is recording minus simulation. `simulated`: one per recording, held-out ones
/// last. Signals are dropped, each with a note, that a simulation lacks, that it repeats, or in
/// which it moves too differently to be compared row by row. Errors (kUsage, kData): other numbers
/// of recordings, another command, nothing to compare, no overlap in time.
core::Status compare_with_simulation(const Recordings& simulated, const Recordings& training,
                                     const Recordings& held_out, const physics::Plant& plant,
                                     std::optional<double> held_out_from_s, Tracks& tracks);

}  // namespace ravencal::diagnose
