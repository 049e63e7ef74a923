// SPDX-License-Identifier: Apache-2.0
//
// How large a correction of a joint may be, by the settings and by what the training of the weights
// saw: the mean of its errors and their deviation, in the joint's SI unit.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "ravencal/plugin.h"

namespace ravencal::rt {

/// config.max_correction_ji, or what lies config.cap_deviations beyond the mean, if that is less.
inline float largest_ji(const ravencal_config& config, std::size_t joint, float mean_ji,
                        float deviation_ji) noexcept {
  const float most_ji = config.max_correction_ji[joint];
  if (!(config.cap_deviations > 0.0F)) return most_ji;
  return std::min(most_ji, std::fabs(mean_ji) + config.cap_deviations * std::fabs(deviation_ji));
}

/// The part that does not change with the inputs: the mean, or none where that is too large.
inline float constant_ji(const ravencal_config& config, std::size_t joint, float mean_ji) noexcept {
  return std::fabs(mean_ji) <= config.max_correction_ji[joint] ? mean_ji : 0.0F;
}

}  // namespace ravencal::rt
