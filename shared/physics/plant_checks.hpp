// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/result.hpp"
#include "physics/plant.hpp"

namespace ravencal::physics {

/// What no table of a plant can check alone: names, frames, routings, and that nothing weighs
/// something without gravity. Errors (kData) name the joint.
core::Status check_plant(const Plant& plant, bool gravity_stated);

}  // namespace ravencal::physics
