// SPDX-License-Identifier: Apache-2.0
//
// Effects that MJCF cannot state, as the C++ source of a callback of MuJoCo.
#pragma once

#include <string>

#include "physics/plant.hpp"

namespace ravencal::physics {

/// Source of the plant's effects of effects_in_models() that a callback adds; empty where it has
/// none. `file`: its own name, for the command that stands in its first line.
std::string effects_callback(const Plant& plant, const std::string& file);

}  // namespace ravencal::physics
