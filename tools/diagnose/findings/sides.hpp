// SPDX-License-Identifier: Apache-2.0
//
// On which side of the motor's encoder and of the gearbox friction, play and elasticity sit, as far
// as two encoders and one effort decide it.
#pragma once

#include <optional>

#include "diagnose/findings/effect_words.hpp"
#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// What the plant and the recordings know of one joint.
struct Sensing {
  bool joint_seen = false;  ///< compared behind the motor, by an encoder of its own
  bool yields = false;      ///< the plant has something elastic, or play, between the two encoders
  bool geared = false;      ///< the plant has a gearbox between motor and cable
};

/// None for effects without a seat.
std::optional<Sides> sides_of(const EffectWords& words, const Sensing& sensing);

}  // namespace ravencal::diagnose
