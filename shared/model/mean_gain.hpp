// SPDX-License-Identifier: Apache-2.0
//
// The coefficient of an exponential mean. Training and the plugin compute it here, each for its own
// tick, so that a time constant means the same in both. Not per tick.
#pragma once

#include <cmath>

namespace ravencal::model {

/// Share of the way from the mean to the value that one tick goes: 1 - exp(-tick / time constant),
/// in (0, 1]. Both in s and above 0.
inline float mean_gain(double tick_s, double time_constant_s) noexcept {
  return static_cast<float>(-std::expm1(-tick_s / time_constant_s));
}

}  // namespace ravencal::model
