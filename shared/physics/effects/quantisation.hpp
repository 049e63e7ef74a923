// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace ravencal::physics {

/// Count of an incremental encoder at a position: it changes where a line passes, so it rounds
/// down.
inline std::int64_t encoder_counts(double position, double resolution) {
  return static_cast<std::int64_t>(std::floor(position / resolution));
}

/// DAC command of the controller: truncated to an integer, then clipped ("soft regulation").
inline double dac_counts(double torque_n_m, double counts_per_n_m, double limit_counts) {
  return std::clamp(std::trunc(torque_n_m * counts_per_n_m), -limit_counts, limit_counts);
}

}  // namespace ravencal::physics
