// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "physics/plant.hpp"

namespace ravencal::physics {

/// Run-out of the pulley that the joint's own motor turns: what the cable gains over the motor's
/// angle. Joints that move the cable otherwise do not turn that pulley. Units: the joint's; motor
/// positions are motor angles over the nominal reduction.
struct Eccentricity {
  double amplitude = 0.0;
  double order = 0.0;  ///< rad per joint unit
  double phase_rad = 0.0;

  explicit Eccentricity(const Joint& joint)
      : amplitude(joint.parameter("eccentricity", "amplitude")),
        order(joint.parameter("eccentricity", "order")),
        phase_rad(joint.parameter("eccentricity", "phase")) {}
  Eccentricity() = default;

  [[nodiscard]] double at(double motor) const {
    return amplitude == 0.0 ? 0.0 : amplitude * std::sin(order * motor + phase_rad);
  }
  /// Of the gain over the motor position: by virtual work also the motor's share of the tension.
  [[nodiscard]] double slope(double motor) const {
    return amplitude == 0.0 ? 0.0 : amplitude * order * std::cos(order * motor + phase_rad);
  }
};

}  // namespace ravencal::physics
