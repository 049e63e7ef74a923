// SPDX-License-Identifier: Apache-2.0
//
// A RAVEN-II has two arms, each the other's mirror image.
#pragma once

#include <string_view>

#include "physics/plant.hpp"

namespace ravencal::physics {

/// The plant of arm "gold" or "green": the same mechanics, mirrored in the plane y = 0 of frame 0.
/// Encoders and drives change sign, centres of mass their place in the links' frames, as the
/// controller has it (raven2 src/raven grav_comp.cpp, COM1_1_GL to COM2_2_GR; state_estimate.cpp).
Plant plant_of_arm(Plant plant, std::string_view arm);

}  // namespace ravencal::physics
