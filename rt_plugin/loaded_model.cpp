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
  gather(readers_, cycle.at_hook, cycle.published, cycle.time_s, channels_.data());
  feature_state_.advance(channels_, features_);
  if (ticks_seen_ <= info_.longest_lag_ticks) ++ticks_seen_;
}

LoadedModel::Prediction LoadedModel::predict() noexcept {
  Prediction prediction;
  const Inspection inputs = scale_inputs();
  const bool inputs_finite = !inputs.not_finite;
  prediction.clamped_inputs = inputs.clamped;
  if (inputs.not_finite) prediction.doubts |= RAVENCAL_DOUBT_NOT_FINITE;
  if (inputs.far_out) prediction.doubts |= RAVENCAL_DOUBT_OUT_OF_RANGE;
  if (is_warming_up()) prediction.doubts |= RAVENCAL_DOUBT_WARMING_UP;
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

/// Without a branch and through pointers that do not overlap, so that the compiler uses vectors.
LoadedModel::Inspection LoadedModel::scale_inputs() noexcept {
  const float* const x = features_.data();
  const float* const lowest = lowest_.data();
  const float* const highest = highest_.data();
  const float* const below = doubtful_below_.data();
  const float* const above = doubtful_above_.data();
  const float* const mean = mean_.data();
  const float* const inverse_scale = inverse_scale_.data();
  float* const __restrict scaled = scaled_.data();
  std::uint32_t not_finite = 0;
  std::uint32_t far_out = 0;
  std::uint32_t clamped = 0;
  for (std::size_t i = 0; i < features_.size(); ++i) {
    not_finite += is_finite(x[i]) ? 0U : 1U;
    far_out +=
        static_cast<std::uint32_t>(x[i] < below[i]) | static_cast<std::uint32_t>(x[i] > above[i]);
    clamped += static_cast<std::uint32_t>(x[i] < lowest[i]) |
               static_cast<std::uint32_t>(x[i] > highest[i]);
    const float not_below = x[i] < lowest[i] ? lowest[i] : x[i];
    const float inside = not_below > highest[i] ? highest[i] : not_below;
    scaled[i] = (inside - mean[i]) * inverse_scale[i];
  }
  return {not_finite != 0, far_out != 0, clamped};
}

void LoadedModel::run_network(std::array<float, RAVENCAL_JOINTS>& outputs) noexcept {
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
