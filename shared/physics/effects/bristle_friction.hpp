// SPDX-License-Identifier: Apache-2.0
//
// Dry friction with elastic presliding: the LuGre model (Canudas de Wit et al., IEEE TAC 1995).
// It sticks truly (no creep under a constant load below the breakaway level) and slips at the
// Coulomb level. Real-time safe; one instance belongs to one thread. Units: the joint's.
#pragma once

#include <algorithm>
#include <cmath>

namespace ravencal::physics {

class BristleFriction {
 public:
  struct Parameters {
    double level = 0.0;              ///< Coulomb level: N m or N
    double stribeck_extra = 0.0;     ///< breakaway level minus Coulomb level
    double stribeck_velocity = 1.0;  ///< velocity at which half of the extra is gone
    double presliding = 1e-4;        ///< bristle deflection at the Coulomb level: rad or m
    double damping = 0.0;            ///< of the bristle, which keeps sticking from ringing
  };

  BristleFriction() = default;
  explicit BristleFriction(const Parameters& parameters) : parameters_(parameters) {}

  [[nodiscard]] const Parameters& parameters() const { return parameters_; }

  /// Effort against the motion for one step of `dt_s`; `scale` multiplies the level (load, wear),
  /// `stiffening` the bristle's stiffness.
  double step(double velocity, double dt_s, double scale = 1.0, double stiffening = 1.0) {
    if (parameters_.level <= 0.0) return 0.0;
    const double ratio = velocity / parameters_.stribeck_velocity;
    const double level =
        scale * (parameters_.level + parameters_.stribeck_extra / (1.0 + ratio * ratio));
    const double stiffness = stiffening * parameters_.level / parameters_.presliding;
    // Implicit in the bristle's own decay, so that any step is stable.
    const double before = deflection_;
    deflection_ =
        (before + velocity * dt_s) / (1.0 + stiffness * std::abs(velocity) * dt_s / level);
    return stiffness * deflection_ + parameters_.damping * (deflection_ - before) / dt_s;
  }

 private:
  Parameters parameters_;
  double deflection_ = 0.0;
};

}  // namespace ravencal::physics
