// SPDX-License-Identifier: Apache-2.0
//
// The joints that the controller's inverse kinematics give back as they are: within their limits,
// and not so near the remote centre that they fail. Outside, the desired joints that follow a
// measured pose are not the measured ones. Real-time thread only.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "ravencal/plugin.h"

namespace ravencal::rt {

class JointRange {
 public:
  explicit JointRange(const ravencal_config& config) noexcept
      : lowest_ji_(std::to_array(config.lowest_ji)),
        highest_ji_(std::to_array(config.highest_ji)),
        near_ji_(config.remote_centre_m - config.remote_centre_radius_m),
        far_ji_(config.remote_centre_m + config.remote_centre_radius_m),
        has_centre_(config.remote_centre_radius_m > 0.0F) {}

  /// The part of a correction of a joint, measured at `own_ji` without it, that leads from no side
  /// of a boundary to the other.
  [[nodiscard]] float allowed_ji(std::size_t joint, float own_ji,
                                 float correction_ji) const noexcept {
    const float margin_ji = kMarginJi[joint];
    float low_ji = lowest_ji_[joint] + margin_ji;
    float high_ji = highest_ji_[joint] - margin_ji;
    if (joint == kInsertion && has_centre_) {
      const int side = (own_ji < near_ji_ ? 0 : 1) + (own_ji > far_ji_ ? 1 : 0);
      const float lows_ji[3] = {low_ji, near_ji_ + margin_ji, far_ji_ + margin_ji};
      const float highs_ji[3] = {near_ji_ - margin_ji, far_ji_ - margin_ji, high_ji};
      low_ji = std::max(low_ji, lows_ji[side]);
      high_ji = std::min(high_ji, highs_ji[side]);
    }
    // None is always allowed.
    const float least_ji = std::min(0.0F, low_ji - own_ji);
    const float most_ji = std::max(0.0F, high_ji - own_ji);
    const float inside_ji = std::max(least_ji, std::min(most_ji, correction_ji));
    // A joint outside is taken to its limit by the controller at the next press, whatever it is
    // told; one that is no number is not corrected anyway.
    const int outside =
        (own_ji <= lowest_ji_[joint] ? 1 : 0) + (own_ji >= highest_ji_[joint] ? 1 : 0);
    const int is_no_number = own_ji - own_ji == 0.0F ? 0 : 2;
    const float choice_ji[4] = {inside_ji, 0.0F, correction_ji, correction_ji};
    return choice_ji[outside + is_no_number];
  }

 private:
  static constexpr std::size_t kInsertion = 2;
  /// The controller holds poses in whole micrometres: so far may the joints be off that it computes
  /// from the pose of measured ones, 1.7 micrometres at 1.7 cm from the remote centre.
  static constexpr std::array<float, RAVENCAL_JOINTS> kMarginJi = {1e-4F, 1e-4F, 1e-5F};

  std::array<float, RAVENCAL_JOINTS> lowest_ji_;
  std::array<float, RAVENCAL_JOINTS> highest_ji_;
  float near_ji_;
  float far_ji_;
  bool has_centre_;
};

}  // namespace ravencal::rt
