// SPDX-License-Identifier: Apache-2.0
//
// The gain of the controller's position error in one recording, against the plant's.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "diagnose/channel/channel.hpp"

namespace ravencal::diagnose {

/// What is asked of each recording.
struct GainQuestion {
  double nominal = 0.0;    ///< the plant's, at the joint
  double tolerance = 0.0;  ///< of the ratio to it
  double chance = 0.0;     ///< of a false name
  bool details = true;     ///< limits too
};

/// Rows [first, last) of one recording.
struct CommandStretch {
  Eigen::Index first = 0;
  Eigen::Index last = 0;
  int number = 0;  ///< of several recordings, from 1; 0: there is only one
};

/// Usable rows that a recording needs to be asked.
inline constexpr Eigen::Index kLeastCommandRows = 200;

/// One of the three, without details maybe none.
struct GainAnswer {
  std::optional<NamedEffect> effect;
  std::optional<double> limit;  ///< ratio's distance from 1 that would be named nine times in ten
  std::string untestable;       ///< reason why neither is known
};

/// `usable`: rows of the series that follow the law and nothing else.
GainAnswer judge_gain(const Series& series, const CommandStretch& stretch,
                      const std::vector<char>& usable, const GainQuestion& question);

}  // namespace ravencal::diagnose
