// SPDX-License-Identifier: Apache-2.0
//
// What a profile asks of the truth beyond its columns. Private to record/.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "record/recording.hpp"

namespace ravencal::record {

/// The first row of each episode, and the number of rows behind them.
std::vector<std::size_t> episode_bounds(std::span<const char> episode_start);

/// Subtracts from the truth, episode by episode, the first truth - estimate that is known.
/// `episode_start`: per row, true for the first one of an episode.
void reference_truth(Recording& recording, std::span<const char> episode_start);

/// Loses the truth before `from_s` since the first row.
void blank_early_truth(Recording& recording, double from_s);

}  // namespace ravencal::record
