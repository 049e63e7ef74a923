// SPDX-License-Identifier: Apache-2.0
//
// Finds the hard stop that a joint was driven against, from its positions alone. A joint that is
// stopped stays where the motion ended; a joint that merely turns round follows a parabola there.
//
// For a distance d from the extreme, let N(d) be the samples of that visit within d. A parabola has
// N(d) ~ sqrt(d), so N(d) / N(9d) = 1/3 at every d, and a sharp turn gives less; a plateau of width
// below d gives 1. The plateau is the narrowest d whose binomial likelihood ratio against the
// parabola is beyond doubt, grown to that ratio's maximum. No width, speed or time is fixed
// beforehand. A motion that was planned to pause at its extreme looks the same: home only where the
// robot homes.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace ravencal::quadrature_reader {

struct HardStop {
  double position_counts = 0.0;  ///< median of the plateau
  double spread_counts = 0.0;    ///< standard deviation of the plateau, quantisation included
  double width_counts = 0.0;     ///< the plateau reaches this far from the extreme
  double confidence = 0.0;       ///< probability of a stop rather than a turn, even prior odds
  std::int64_t samples = 0;      ///< of the plateau
  std::int64_t from_ns = 0;      ///< when the joint was there
  std::int64_t to_ns = 0;
};

/// `position_counts` at the uniform instants `t_ns` (same length), over a time that includes the
/// stop. 250 Hz is right: RAVEN-II presses for little more than 0.2 s, which has to be enough
/// samples, and samples closer than a joint's own vibration are not independent.
/// `at_maximum`: the stop is where the counts are largest, else smallest. nullopt: no stop found.
std::optional<HardStop> find_hard_stop(std::span<const std::int64_t> t_ns,
                                       std::span<const double> position_counts, bool at_maximum);

}  // namespace ravencal::quadrature_reader
