// SPDX-License-Identifier: Apache-2.0
//
// The sizes at which things happen at one joint: from these every start and bound is made.
#pragma once

#include <algorithm>
#include <string>

#include "diagnose/model/likelihood.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

/// Standard deviation over tolerance: a tolerance holds nearly all of what is within it.
inline constexpr double kDeviationPerTolerance = 0.6;

struct Scales {
  std::size_t joint = 0;
  bool prismatic = false;
  bool effort = false, truth = false, law = false;  ///< channels of the joint
  bool weight = false;                              ///< its load changes with posture
  double position = 1.0;                            ///< rad, or the metres that stand for one
  double range = 1.0;                               ///< that the motor moves over
  double lowest = 0.0;                              ///< of it
  double load = 1.0;                                ///< effort of friction, N m or N
  double weight_load = 0.0;                         ///< greatest effort of the links
  double length_s = 1.0;                            ///< of the longest recording
  double quantum = 0.0;                             ///< of the external encoder
};

Scales scales_of(const physics::Plant& plant, std::size_t joint, const Likelihood& training);

/// "N_m", "rad_per_N_m": as reports have it.
std::string unit_of(const std::string& effect, const std::string& parameter, bool prismatic);

}  // namespace ravencal::diagnose
