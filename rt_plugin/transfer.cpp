// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/transfer.hpp"

namespace ravencal::rt {
namespace {

float towards_zero(float value, float step) noexcept {
  if (value > step) return value - step;
  return value < -step ? value + step : 0.0F;
}

}  // namespace

JointVector Transfer::follow(const CorrectionRequest& request, const JointVector& applied_ji,
                             float passed_ticks) noexcept {
  const bool goes_on = joined_ && request.same_weights;
  JointVector target_ji{};
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    if (goes_on) {
      // The change of confidence alone; the prediction's own change is not part of the offset.
      offset_ji_[j] -= (request.confidence - confidence_) * variable_ji_[j];
    } else {
      offset_ji_[j] = applied_ji[j] - request.requested_ji(j);
    }
    const float share_ji = blend_share_ * request.travelled_ji[j];
    const float step_ji = blend_step_ji_[j] * passed_ticks;
    offset_ji_[j] = towards_zero(offset_ji_[j], share_ji < step_ji ? share_ji : step_ji);
    variable_ji_[j] = request.predicted_ji[j] - request.constant_ji[j];
    target_ji[j] = request.requested_ji(j) + offset_ji_[j];
  }
  confidence_ = request.confidence;
  joined_ = true;
  return target_ji;
}

}  // namespace ravencal::rt
