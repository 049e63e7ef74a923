// SPDX-License-Identifier: Apache-2.0
//
// The real-time half of LoadedModel: one evaluation.
#include "rt_plugin/loaded_model.hpp"

namespace ravencal::rt {
namespace {

/// False for NaN and infinities.
bool is_finite(float value) noexcept { return value - value == 0.0F; }

}  // namespace

LoadedModel::Prediction LoadedModel::predict(const ravencal_state& current,
                                             const ravencal_state& latched, float time_s) noexcept {
  gather(readers_, current, latched, time_s, channels_);
  feature_state_.advance(channels_, features_);

  Prediction prediction;
  prediction.doubts = inspect_inputs(prediction);
  if (ticks_seen_ < info_.longest_lag_ticks) {
    ++ticks_seen_;
    prediction.doubts |= RAVENCAL_DOUBT_WARMING_UP;
  }

  // The network runs whatever the inputs are, so that its time does not depend on them.
  std::array<float, RAVENCAL_JOINTS> outputs{};
  run_network(outputs);
  for (std::size_t j = 0; j < output_count_; ++j) {
    prediction.error_ji[joint_of_output_[j]] = outputs[j];
    if (!is_finite(outputs[j]) && (prediction.doubts & RAVENCAL_DOUBT_NOT_FINITE) == 0) {
      prediction.doubts |= RAVENCAL_DOUBT_NETWORK;
    }
  }
  return prediction;
}

std::uint32_t LoadedModel::inspect_inputs(Prediction& prediction) const noexcept {
  std::uint32_t not_finite = 0;
  std::uint32_t far_out = 0;
  std::uint32_t clamped = 0;
  for (std::size_t i = 0; i < ops_.size(); ++i) {
    const float x = features_[i];
    not_finite += is_finite(x) ? 0U : 1U;
    far_out += (x < doubtful_below_[i] || x > doubtful_above_[i]) ? 1U : 0U;
    clamped += (x < lowest_[i] || x > highest_[i]) ? 1U : 0U;
  }
  prediction.clamped_inputs = clamped;
  return (not_finite != 0 ? RAVENCAL_DOUBT_NOT_FINITE : 0U) |
         (far_out != 0 ? RAVENCAL_DOUBT_OUT_OF_RANGE : 0U);
}

void LoadedModel::run_network(std::array<float, RAVENCAL_JOINTS>& outputs) noexcept {
  for (std::size_t i = 0; i < features_.size(); ++i) {
    const float above = features_[i] < lowest_[i] ? lowest_[i] : features_[i];
    const float clamped = above > highest_[i] ? highest_[i] : above;
    scaled_[i] = (clamped - mean_[i]) * inverse_scale_[i];
  }
  forward_(network_, scaled_.data(), outputs.data(), scratch_.data());
  for (std::size_t j = 0; j < output_count_; ++j) {
    outputs[j] = outputs[j] * output_scale_[j] + output_mean_[j];
  }
}

void LoadedModel::forget_history() noexcept {
  feature_state_.reset();
  ticks_seen_ = 0;
}

}  // namespace ravencal::rt
