// SPDX-License-Identifier: Apache-2.0
//
// The plant that a diagnosis makes of the one that was diagnosed.
#pragma once

#include "diagnose/findings/findings.hpp"
#include "physics/plant.hpp"

namespace ravencal::diagnose {

/// The plant with the refitted parameters, the effects without a name and the named ones. What a
/// plant cannot say stays out, so that plant_text of it is always one that parse_plant reads if
/// `plant` is. `source` remains the plant's, for messages; `hash` is 0: no file has these bytes.
physics::Plant improved_plant(const physics::Plant& plant, const Report& report);

/// Gives the report its improved plant and marks the findings that no plant can hold.
void improve(const physics::Plant& plant, Report& report);

}  // namespace ravencal::diagnose
