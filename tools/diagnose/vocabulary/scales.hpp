// SPDX-License-Identifier: Apache-2.0
//
// The sizes at which things happen at one joint: from these every start and bound is made.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "diagnose/model/likelihood.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

/// Standard deviation over tolerance: a tolerance holds nearly all of what is within it.
inline constexpr double kDeviationPerTolerance = 0.6;
/// Standard deviation of the delay between two signals, which plants seldom state.
inline constexpr double kDelayS = 0.002;

/// A recorded load that may stretch the joint's cable.
struct LoadScale {
  std::string name;
  std::string unit;
  double largest = 0.0;  ///< by amount
};

struct Scales {
  std::size_t joint = 0;
  bool prismatic = false;
  bool effort = false, truth = false, law = false;  ///< channels of the joint
  bool tracking = false;                            ///< the joint's position follows its command
  /// ...under the plant's law, so that it shows the drive, and no transmission.
  bool followed = false;
  bool moves = false;            ///< speeds show, and not rests alone
  bool weight = false;           ///< its load changes with posture
  bool unknown_weight = false;   ///< there is gravity, and the plant has no links
  double position = 1.0;         ///< rad, or the metres that stand for one
  double range = 1.0;            ///< that the motor moves over
  double lowest = 0.0;           ///< of it
  double load = 1.0;             ///< effort of friction, N m or N
  double weight_load = 0.0;      ///< greatest effort of the links
  double greatest_effort = 0.0;  ///< that was recorded
  double length_s = 1.0;         ///< of the longest recording
  double desired_rate = 1.0;     ///< as LawCircumstances has it
  double quantum = 0.0;          ///< of the external encoder
  std::vector<LoadScale> loads{};
};

Scales scales_of(const physics::Plant& plant, std::size_t joint, const Likelihood& training);

struct Untestable {
  std::string because;        ///< in words; empty: it is testable
  bool by_recording = false;  ///< another recording could show it with this plant
};

/// Why these recordings cannot show an effect of the vocabulary on a joint whose channels they
/// hold.
Untestable why_untestable(const std::string& id, const Scales& scales, const physics::Plant& plant);

/// "N_m", "rad_per_N_m": as reports have it.
std::string unit_of(const std::string& effect, const std::string& parameter, bool prismatic);

}  // namespace ravencal::diagnose
