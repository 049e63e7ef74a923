// SPDX-License-Identifier: Apache-2.0
//
// Rate-independent hysteresis of a cable whose strands rub against each other: a Prandtl-Ishlinskii
// sum of stop operators (elastic-slip elements in parallel). Loops close, minor loops are
// congruent, and speed does not matter. Real-time safe. Units: the joint's.
#pragma once

#include <array>
#include <cstddef>

#include "physics/effects/slip_element.hpp"

namespace ravencal::physics {

/// Slip elements that stand for a cable's strands.
inline constexpr std::size_t kStrands = 4;

/// Stretch at which strand `index` slips if the last of them slips at `yield`.
constexpr double strand_limit(double yield, std::size_t index) {
  return yield * static_cast<double>(index + 1) / kStrands;
}

class Hysteresis {
 public:
  Hysteresis() = default;
  /// `stiffness`: of all elements together while none slips; `yield`: stretch at which the last of
  /// them slips. The elements share the stiffness and slip at 1/4, 2/4, 3/4 and 4/4 of `yield`.
  Hysteresis(double stiffness, double yield) : stiffness_(stiffness / kStrands), yield_(yield) {}

  /// Effort after the stretch has changed by `change`.
  double step(double change) {
    double sum = 0.0;
    for (std::size_t i = 0; i < kStrands; ++i) {
      elements_[i] = slipped(elements_[i], change, strand_limit(yield_, i));
      sum += elements_[i];
    }
    return stiffness_ * sum;
  }

 private:
  double stiffness_ = 0.0;
  double yield_ = 0.0;
  std::array<double, kStrands> elements_{};
};

}  // namespace ravencal::physics
