// SPDX-License-Identifier: Apache-2.0
//
// Rate-independent hysteresis of a cable whose strands rub against each other: a Prandtl-Ishlinskii
// sum of stop operators (elastic-slip elements in parallel). Loops close, minor loops are
// congruent, and speed does not matter. Real-time safe. Units: the joint's.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace ravencal::physics {

class Hysteresis {
 public:
  static constexpr std::size_t kElements = 4;

  Hysteresis() = default;
  /// `stiffness`: of all elements together while none slips; `yield`: stretch at which the last of
  /// them slips. The elements share the stiffness and slip at 1/4, 2/4, 3/4 and 4/4 of `yield`.
  Hysteresis(double stiffness, double yield) : stiffness_(stiffness / kElements), yield_(yield) {}

  /// Effort after the stretch has changed by `change`.
  double step(double change) {
    double sum = 0.0;
    for (std::size_t i = 0; i < kElements; ++i) {
      const double limit = yield_ * static_cast<double>(i + 1) / kElements;
      elements_[i] = std::clamp(elements_[i] + change, -limit, limit);
      sum += elements_[i];
    }
    return stiffness_ * sum;
  }

 private:
  double stiffness_ = 0.0;
  double yield_ = 0.0;
  std::array<double, kElements> elements_{};
};

}  // namespace ravencal::physics
