// SPDX-License-Identifier: Apache-2.0
//
// The real-time half of LoadedModel: one evaluation.
#include "rt_plugin/loaded_model.hpp"

namespace ravencal::rt {
namespace {

/// False for NaN and infinities.
bool is_finite(float value) noexcept { return value - value == 0.0F; }

/// Dot product of whole lines of 16, in 16 sums: the compiler must not reorder a single one, and
/// without that it cannot use vectors.
float dot(const float* a, const float* b, std::size_t lines) noexcept {
  constexpr std::size_t kLanes = model::packed::kLineLanes;
  std::array<float, kLanes> sums{};
  for (std::size_t line = 0; line < lines; ++line) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      sums[lane] += a[line * kLanes + lane] * b[line * kLanes + lane];
    }
  }
  for (std::size_t half = kLanes / 2; half > 0; half /= 2) {
    for (std::size_t lane = 0; lane < half; ++lane) sums[lane] += sums[lane + half];
  }
  return sums[0];
}

}  // namespace

void LoadedModel::observe(const CycleView& cycle) noexcept {
  gather(readers_, cycle.at_hook, cycle.published, cycle.time_s, channels_);
  feature_state_.advance(channels_, features_);
  if (ticks_seen_ <= info_.longest_lag_ticks) ++ticks_seen_;
}

LoadedModel::Prediction LoadedModel::predict() noexcept {
  Prediction prediction;
  prediction.doubts = inspect_inputs(prediction);
  if (is_warming_up()) prediction.doubts |= RAVENCAL_DOUBT_WARMING_UP;

  const bool inputs_finite = (prediction.doubts & RAVENCAL_DOUBT_NOT_FINITE) == 0;
  prediction.doubts |= fill_window(inputs_finite && !is_warming_up());
  // The network runs whatever the inputs are, so that its time does not depend on them.
  std::array<float, RAVENCAL_JOINTS> outputs{};
  run_network(outputs);
  for (std::size_t j = 0; j < output_count_; ++j) {
    const bool finite = is_finite(outputs[j]);
    prediction.error_ji[joint_of_output_[j]] = finite ? outputs[j] : 0.0F;
    if (!finite && inputs_finite) prediction.doubts |= RAVENCAL_DOUBT_NETWORK;
  }
  prediction.confidence = confidence();
  if (prediction.confidence == 0.0F && inputs_finite) prediction.doubts |= RAVENCAL_DOUBT_DISTANCE;
  return prediction;
}

std::uint32_t LoadedModel::fill_window(bool inputs_whole) noexcept {
  const bool is_whole = window_ticks_seen_ >= window_ticks_;
  window_ticks_seen_ = !inputs_whole ? 0 : window_ticks_seen_ + (is_whole ? 0 : 1);
  return is_whole ? 0U : RAVENCAL_DOUBT_WARMING_UP;
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

/// The formula is that of model/trust_region.hpp. Rounding may leave a little less than nothing
/// beside the directions.
float LoadedModel::confidence() const noexcept {
  if (trust_.rank == 0) return 1.0F;
  const std::size_t lines = scaled_.size() / model::packed::kLineLanes;
  float along = 0.0F;
  float weighted = 0.0F;
  for (std::size_t k = 0; k < trust_.rank; ++k) {
    const float part = dot(trust_.directions + k * scaled_.size(), scaled_.data(), lines);
    along += part * part;
    weighted += part * part * trust_.inverse_variance[k];
  }
  const float beside = dot(scaled_.data(), scaled_.data(), lines) - along;
  const float distance =
      (weighted + (beside > 0.0F ? beside : 0.0F) * trust_.inverse_residual_variance) *
      trust_.per_input;
  const float share = (trust_.none_distance - distance) * trust_.per_width;
  if (!(share > 0.0F)) return 0.0F;  // no number, too
  return share < 1.0F ? share : 1.0F;
}

void LoadedModel::forget_history() noexcept {
  feature_state_.reset();
  ticks_seen_ = 0;
  window_ticks_seen_ = 0;
}

}  // namespace ravencal::rt
