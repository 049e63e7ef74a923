// SPDX-License-Identifier: Apache-2.0
#include "physics/robot_model/effects_callback.hpp"

namespace ravencal::physics {

std::string effects_callback(const Plant& plant, const std::string& file) {
  (void)plant;
  (void)file;
  return {};
}

}  // namespace ravencal::physics
