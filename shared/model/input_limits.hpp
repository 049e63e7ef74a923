// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace ravencal::model {

/// Where the plugin clamps an input before the network sees it.
struct InputLimits {
  float low;
  float high;
};

/// A network may extrapolate a little, but not without end: inputs are clamped half a width of
/// their trained range beyond it. Half, because a zig-zag's cube has 1/sqrt(3) of the joint ranges
/// as edges (trajectory.hpp), so that motion over the whole ranges leaves it by (sqrt(3) - 1) / 2 =
/// 0.37 widths on either side. A constant stays the constant that training saw.
constexpr InputLimits input_limits(double trained_min, double trained_max) noexcept {
  constexpr double kWidthsBeyond = 0.5;
  const double beyond = kWidthsBeyond * (trained_max - trained_min);
  return {static_cast<float>(trained_min - beyond), static_cast<float>(trained_max + beyond)};
}

}  // namespace ravencal::model
