// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "diagnose/vocabulary/scales.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

/// Why these recordings cannot show an effect of the vocabulary on a joint whose channels they
/// hold, in words; empty if they can.
std::string why_untestable(const std::string& id, const Scales& scales,
                           const physics::Plant& plant);

}  // namespace ravencal::diagnose
