// SPDX-License-Identifier: Apache-2.0
//
// Whether what came in can be what a robot did: a set-up fault (a factor of 4, exchanged plugs, a
// turned sign, a counter that wraps) leaves a recording that every reader accepts and that no robot
// can have made.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "record/recording.hpp"

namespace ravencal::record {

/// Meta key: channels, separated by commas, whose user has said that they are right as they are.
/// Nothing about them is an error any more.
inline constexpr std::string_view kKnownImplausible = "known_implausible";

struct Implausibility {
  std::string kind;     ///< gain, sign, exchanged, offset, unrelated, turn, jump, frozen, velocity,
                        ///< effort, stamps, rate
  std::string channel;  ///< whose values they are; empty: the time
  double figure = 0.0;  ///< what was measured, in the words of `sentence`
  std::int64_t t_ns = 0;  ///< when first; of the whole recording: its first row
  bool is_error = false;  ///< no training or diagnosis on it can be right
  std::string sentence;   ///< joint, figure, moment and remedy
};

/// In the order truth, signals, stamps. Nothing where too little moves to tell.
std::vector<Implausibility> implausibilities(const Recording& recording);

/// The sentences of them all, each under its file's name. Error (kData) where one of them is an
/// error.
core::Result<std::vector<std::string>> plausibility_warnings(
    const std::vector<const Recording*>& recordings);

/// Less is what slack, stretch and a tracker's noise alone can make of a joint's motion.
inline constexpr double kLeastTravel_rad = 0.175;  // 10 deg
inline constexpr double kLeastTravel_m = 0.010;

}  // namespace ravencal::record
