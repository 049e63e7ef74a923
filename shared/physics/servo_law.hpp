// SPDX-License-Identifier: Apache-2.0
//
// A joint's servo as the joint feels it: proportional to the position error, with damping.
#pragma once

#include <algorithm>
#include <optional>

#include "physics/plant.hpp"

namespace ravencal::physics {

/// Gains referred to the joint: N m and rad, or N and m.
struct ServoLaw {
  double position = 0.0;      ///< effort per position error
  double rate = 0.0;          ///< effort per velocity, against it
  double desired_rate = 0.0;  ///< effort per desired velocity
  double limit = 0.0;         ///< greatest effort; 0: none

  [[nodiscard]] double effort(double position_error, double velocity,
                              double desired_velocity = 0.0) const {
    return limited(position * position_error - rate * velocity + desired_rate * desired_velocity);
  }
  /// Of a step from that velocity to one of zero, without the limit. The other half of the rate
  /// acts on the velocity at the step's end, so that stiff servos stay stable at any step.
  [[nodiscard]] double effort_ahead(double position_error, double velocity,
                                    double desired_velocity) const {
    return position * position_error - half_rate() * velocity + desired_rate * desired_velocity;
  }
  [[nodiscard]] double half_rate() const { return 0.5 * rate; }
  [[nodiscard]] double limited(double asked) const {
    return limit > 0.0 ? std::clamp(asked, -limit, limit) : asked;
  }
};

/// The plant's, within what its DAC can ask for; none without a controller.
std::optional<ServoLaw> servo_law(const Joint& joint);

}  // namespace ravencal::physics
