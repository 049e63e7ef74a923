// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "core/random.hpp"

namespace ravencal::physics {

/// A slow random quantity with correlation time `time_s` (Ornstein-Uhlenbeck process):
/// temperature and lubrication, which the controller does not measure.
class Wander {
 public:
  Wander() = default;
  Wander(double deviation, double time_s) : deviation_(deviation), time_s_(time_s) {}

  /// Draws the state from the stationary distribution.
  void restart(core::Random& random) {
    if (deviation_ > 0.0) value_ = deviation_ * random.normal();
  }

  /// Value `dt_s` later, with the exact transition of the process.
  double step(double dt_s, core::Random& random) {
    if (deviation_ <= 0.0) return 0.0;
    const double keep = std::exp(-dt_s / time_s_);
    value_ = keep * value_ + deviation_ * std::sqrt(1.0 - keep * keep) * random.normal();
    return value_;
  }

  [[nodiscard]] double value() const { return value_; }

 private:
  double deviation_ = 0.0;
  double time_s_ = 1.0;
  double value_ = 0.0;
};

}  // namespace ravencal::physics
