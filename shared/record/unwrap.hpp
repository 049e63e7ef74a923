// SPDX-License-Identifier: Apache-2.0
//
// Positions that start again after a turn, or after any other width of their counter, are counted
// on. Pure functions, any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "record/profile.hpp"
#include "record/recording.hpp"

namespace ravencal::record {

/// Puts each value on the turn that lies nearest to the value before it; lost values (NaN) between
/// them do no harm while less than half a turn passes. A single wild value moves no later one to
/// another turn. Returns how often the values wrapped. `turn` > 0, in the unit of the values;
/// `t_ns` never decreases and has a stamp for each value.
std::size_t unwrap(std::span<double> values, std::span<const std::int64_t> t_ns, double turn);

/// Unwraps the channels whose profile says that they wrap, episode by episode, with an event for
/// each that did. Those of one joint and one width begin an episode on the turn that brings them
/// nearest to the first of them, so that a command and its answer on both sides of the seam stay
/// together. `episode_start`: per row, true for the first one of an episode.
void unwrap_channels(Recording& recording, const Profile& profile,
                     std::span<const char> episode_start);

}  // namespace ravencal::record
