// SPDX-License-Identifier: Apache-2.0
//
// Pulses in what a model leaves of a channel: it stands at one of two levels and passes from one to
// the other at moments that the motion does not say.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "diagnose/findings/findings.hpp"
#include "diagnose/track/track.hpp"

namespace ravencal::diagnose {

struct Pulses {
  double size = 0.0;                                  ///< of the level that is on, over the other
  std::vector<std::vector<Interval>> on_s;            ///< [recording]: begin and end of each pulse
  [[nodiscard]] std::vector<Interval> all_s() const;  ///< in the order of the recordings
};

/// None where there are no two levels, or where position and direction of motion say which it is.
/// `left`: of a channel of the joint, measured minus predicted, filtered: [recording][row]; empty
/// where nothing was recorded.
std::optional<Pulses> pulses_in(const std::vector<Track>& tracks, std::size_t joint,
                                const std::vector<Eigen::VectorXd>& left);

/// Share of each row's time in which the pulses of a recording are on.
Eigen::VectorXd share_on(const Track& track, const std::vector<Interval>& on_s);

}  // namespace ravencal::diagnose
