// SPDX-License-Identifier: Apache-2.0
//
// What a profile asks of the truth beyond its columns. Private to record/.
#pragma once

#include <span>

#include "record/recording.hpp"

namespace ravencal::record {

/// Subtracts from the truth, episode by episode, the first truth - estimate that is known.
/// `episode_start`: per row, true for the first one of an episode.
void reference_truth(Recording& recording, std::span<const char> episode_start);

/// Loses the truth before `from_s` since the first row.
void blank_early_truth(Recording& recording, double from_s);

}  // namespace ravencal::record
