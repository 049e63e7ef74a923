// SPDX-License-Identifier: Apache-2.0
//
// How a channel of another simulation differs from the recorded one, and whether the two can be
// compared row by row.
#pragma once

#include <Eigen/Core>
#include <string>

#include "diagnose/series/series.hpp"

namespace ravencal::diagnose {

/// A signal that is nearer to the measured one than this share of it was copied from it. Source:
/// converters of drives have 12 bits or a little more and resolve a few thousandths of a usual
/// effort, so that nothing computed comes nearer to what they measured.
inline constexpr double kCopied = 1e-3;

/// Share of the motion's variance that a simulation may miss and still be compared row by row.
/// Source: a simulation is satisfactory from an efficiency (1 - this share) of 0.5 on (Moriasi et
/// al. 2007, Transactions of the ASABE 50, 885-900; the efficiency is Nash's and Sutcliffe's).
inline constexpr double kMostMotionMissed = 0.5;

/// Over rows that both have.
struct Difference {
  double measured = 0.0;  ///< deviation of the recorded signal
  double signal = 0.0;    ///< RMS of recording minus simulation
  double moved = 0.0;     ///< deviation of the recorded motion, or of a drive's speed
  double motion = 0.0;    ///< deviation of recorded minus simulated motion
  Eigen::Index rows = 0;

  [[nodiscard]] bool copied() const { return signal <= kCopied * measured; }
  [[nodiscard]] bool same_motion() const { return motion <= kCopied * moved; }
  /// Of the motion's variance.
  [[nodiscard]] double missed() const {
    return moved > 0.0 ? motion * motion / (moved * moved) : 0.0;
  }
};

/// `simulated`: the same channel, row by row.
Difference difference_of(const Series& recorded, const Series& simulated);

/// "joint elbow (drive)".
std::string channel_words(const Series& series);

/// "speed differs by 0.12 of 3.4 deg/s RMS".
std::string motion_words(const Series& series, const Difference& difference);

/// Why the channel cannot be compared with its simulation; empty if it can.
std::string incomparable(const Series& series, const Difference& difference);

}  // namespace ravencal::diagnose
