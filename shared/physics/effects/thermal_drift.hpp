// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

namespace ravencal::physics {

/// Length that a cable has gained after `age_s` of warming up: final (1 - exp(-age/time)).
inline double thermal_drift(double final_value, double time_s, double age_s) {
  return time_s > 0.0 ? final_value * (1.0 - std::exp(-age_s / time_s)) : 0.0;
}

}  // namespace ravencal::physics
