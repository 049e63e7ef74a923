// SPDX-License-Identifier: Apache-2.0
//
// What physics of any name may depend on, row by row: where, how fast and under which load a joint
// moved, and how the joints beside it did.
#pragma once

#include <string>
#include <vector>

#include "diagnose/model/likelihood.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

struct Circumstance {
  std::string name;  ///< "position", "velocity", "acceleration", "load", "position of q5", ...
  std::string unit;
  ByRecording value;  ///< [recording][row]; rates through the filter of the residuals
};

struct Circumstances {
  std::vector<Circumstance> own;     ///< position, velocity, acceleration, and the load if known
  std::vector<Circumstance> others;  ///< positions and velocities of the other joints
};

/// Of the motor for a drive and its command, of the joint for its position. The load is the tension
/// of the cable that `plant` predicts.
Circumstances circumstances_of(const Channel& channel, const Likelihood& rows,
                               const physics::Plant& plant);

}  // namespace ravencal::diagnose
