// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "physics/plant.hpp"

namespace ravencal::physics {

/// Run-out of a pulley: what the cable gains over the position of its drive. Units: the joint's.
struct Eccentricity {
  double amplitude = 0.0;
  double order = 0.0;  ///< rad per joint unit
  double phase_rad = 0.0;

  explicit Eccentricity(const Joint& joint)
      : amplitude(joint.parameter("eccentricity", "amplitude")),
        order(joint.parameter("eccentricity", "order")),
        phase_rad(joint.parameter("eccentricity", "phase")) {}
  Eccentricity() = default;

  [[nodiscard]] double at(double drive) const {
    return amplitude == 0.0 ? 0.0 : amplitude * std::sin(order * drive + phase_rad);
  }
};

}  // namespace ravencal::physics
