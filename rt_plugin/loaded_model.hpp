// SPDX-License-Identifier: Apache-2.0
//
// A verified model, ready to run: the blob, whose network runs in place, and everything else that
// one step reads or writes for it, in two mappings that are page-aligned, touched and, where the
// system allows it, locked in RAM. Made and freed by a
// thread that is not the real-time one; between that, the real-time thread owns it alone.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "model/blob_format.hpp"
#include "model/feature_state.hpp"
#include "ravencal/plugin.h"
#include "rt_plugin/gather.hpp"
#include "rt_plugin/joint_vector.hpp"
#include "rt_plugin/kernels/forward.hpp"
#include "rt_plugin/load_failure.hpp"

namespace ravencal::rt {

/// One control cycle, as a model sees it.
struct CycleView {
  const ravencal_state& at_hook;
  const ravencal_state& published;  ///< at the end of the cycle before
  float time_s = 0.0F;              ///< value of the time channel
};

class LoadedModel {
 public:
  /// What one evaluation says.
  struct Prediction {
    JointVector error_ji{};    ///< to add to the joints; 0 where the model has no output
    float confidence = 0.0F;   ///< 0..1: how like the training set the inputs are
    std::uint32_t doubts = 0;  ///< RAVENCAL_DOUBT_*
    std::uint32_t clamped_inputs = 0;
  };

  /// [rt] Takes the channels of this cycle; once per cycle, before predict.
  void observe(const CycleView& cycle) noexcept;

  /// [rt] Evaluates the network for the cycle observed last. Takes the same time whatever the
  /// values are.
  Prediction predict() noexcept;

  /// [rt] Whether fewer cycles were observed than the oldest input goes back.
  [[nodiscard]] bool is_warming_up() const noexcept {
    return ticks_seen_ <= info_.longest_lag_ticks;
  }

  /// [rt] Forgets past ticks: what came before has no known distance in time.
  void forget_history() noexcept;

  /// The part of the errors that does not change with the inputs: their mean in training. 0 where
  /// the model has no output, or where it exceeds config.max_correction_ji.
  [[nodiscard]] const JointVector& constant_ji() const noexcept { return constant_ji_; }

  /// The largest correction: config.max_correction_ji, or what lies config.cap_deviations of the
  /// training set's errors beyond their mean, if that is less. 0 where the model has no output.
  [[nodiscard]] const JointVector& largest_ji() const noexcept { return largest_ji_; }

  [[nodiscard]] const ravencal_info& info() const noexcept { return info_; }

 private:
  friend class ModelLoader;
  friend class ModelSwap;
  friend void free_model(LoadedModel* model) noexcept;

  /// Counts this pass into a GRU's window: a doubt until it holds only samples whose inputs were
  /// all there, without a gap.
  std::uint32_t fill_window(bool inputs_whole) noexcept;

  /// What speaks against features_.
  struct Inspection {
    bool not_finite = false;
    bool far_out = false;       ///< where the model does not know
    std::uint32_t clamped = 0;  ///< inputs
  };

  /// Clamps and scales features_ into scaled_. Inputs are clamped (input_limits.hpp) so that the
  /// network never extrapolates far.
  Inspection scale_inputs() noexcept;

  /// Confidence by the distance of scaled_ from the training set.
  [[nodiscard]] float confidence() const noexcept;

  /// Runs the network on scaled_ and gives its outputs in SI units.
  void run_network(std::array<float, RAVENCAL_JOINTS>& outputs) noexcept;

  model::packed::PackedView network_;  ///< within blob_
  kernels::Forward forward_ = nullptr;
  std::span<std::byte> scratch_;
  std::array<float, RAVENCAL_JOINTS> output_mean_{};
  std::array<float, RAVENCAL_JOINTS> output_scale_{};
  std::array<std::uint8_t, RAVENCAL_JOINTS> joint_of_output_{};
  std::size_t output_count_ = 0;
  JointVector constant_ji_{};
  JointVector largest_ji_{};

  std::span<ChannelReader> readers_;  ///< of channels_, in their order
  std::span<float> channels_;         ///< their values in this tick
  std::span<model::FeatureOp> ops_;   ///< one per input
  model::FeatureState feature_state_;
  // One per input: SI value, clamping, scaling, what the network sees.
  std::span<float> features_;
  std::span<float> lowest_;
  std::span<float> highest_;
  std::span<float> mean_;
  std::span<float> inverse_scale_;
  std::span<float> scaled_;          ///< padded with zeros to whole lines
  std::span<float> doubtful_below_;  ///< per input: beyond these, the model does not know
  std::span<float> doubtful_above_;
  /// Distance from the training set (model/trust_region.hpp); directions lie within blob_.
  struct Trust {
    std::size_t rank = 0;
    const float* directions = nullptr;
    std::array<float, model::blob::kMaxTrustRank> inverse_variance{};
    float inverse_residual_variance = 0.0F;
    float none_distance = 0.0F;
    float per_width = 0.0F;  ///< 1 / (none - full distance)
    float per_input = 0.0F;  ///< 1 / number of inputs
  };
  Trust trust_;
  std::size_t window_ticks_ = 0;       ///< from a GRU's first sample to its last
  std::size_t window_ticks_seen_ = 0;  ///< passes of the network, up to window_ticks_
  std::size_t ticks_seen_ = 0;         ///< up to one more than the oldest input goes back

  ravencal_info info_{};
  std::size_t mapping_bytes_ = 0;
  std::span<std::byte> blob_;
  LoadedModel* next_retired_ = nullptr;  ///< ModelSwap's list
};

/// [init] Reads, verifies and maps the blob at `path`. Null on refusal, with the reason in
/// `failure`.
LoadedModel* load_model(const char* path, const ravencal_config& config,
                        LoadFailure& failure) noexcept;

/// [init] Gives the memory back; null is allowed.
void free_model(LoadedModel* model) noexcept;

}  // namespace ravencal::rt
