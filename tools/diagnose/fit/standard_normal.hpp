// SPDX-License-Identifier: Apache-2.0
//
// Normal draws that every standard library gives alike (Box and Muller 1958), so that a seed gives
// the same report everywhere.
#pragma once

#include <cmath>
#include <numbers>
#include <random>

namespace ravencal::diagnose {

inline double standard_normal(std::mt19937_64& engine) {
  const double uniform = static_cast<double>((engine() >> 11U) + 1) * 0x1p-53;
  const double angle = 2.0 * std::numbers::pi * static_cast<double>(engine() >> 11U) * 0x1p-53;
  return std::sqrt(-2.0 * std::log(uniform)) * std::cos(angle);
}

}  // namespace ravencal::diagnose
