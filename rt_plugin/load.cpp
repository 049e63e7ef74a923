// SPDX-License-Identifier: Apache-2.0
//
// From a blob file to a LoadedModel: read the file, check every byte, choose the kernels, lay
// everything else out in one mapping, run the blob's self-test. Not for the real-time thread.
#include <sys/mman.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <new>
#include <string_view>

#include "core/catalogue.hpp"
#include "model/blob_view.hpp"
#include "model/input_limits.hpp"
#include "model/mean_gain.hpp"
#include "rt_plugin/admission.hpp"
#include "rt_plugin/blob_memory.hpp"
#include "rt_plugin/cap.hpp"
#include "rt_plugin/layout.hpp"
#include "rt_plugin/loaded_model.hpp"

namespace ravencal::rt {
namespace {

using model::BlobView;

constexpr std::size_t kMaxMappingBytes = std::size_t{1} << 28U;

// How far beyond its trained range, in widths of that range, an input may go before the model is
// not believed. Positions: as far as the network may extrapolate (model/input_limits.hpp); farther
// out the error was never measured. Speeds, torques and commands: a whole width, because their
// peaks in unseen motion exceed those of a zig-zag within the same workspace.
constexpr double kPositionMargin = 0.5;
constexpr double kOtherMargin = 1.0;

/// AVX-VNNI is allowed wherever AVX2 is: it gives the same bits.
kernels::Isa isa_limit(std::uint32_t max_isa) noexcept {
  switch (max_isa) {
    case RAVENCAL_ISA_BASELINE:
    case RAVENCAL_ISA_NEON:
      return kernels::Isa::kPortable;
    case RAVENCAL_ISA_AVX2:
      return kernels::Isa::kAvx2Vnni;
    case RAVENCAL_ISA_AVX512:
      return kernels::Isa::kAvx512;
    default:
      return kernels::Isa::kAvx512Vnni;
  }
}

std::uint32_t abi_isa(kernels::Isa isa) noexcept {
#if defined(__aarch64__)
  (void)isa;
  return RAVENCAL_ISA_NEON;
#else
  if (isa == kernels::Isa::kAvx512Vnni) return RAVENCAL_ISA_AVX512_VNNI;
  if (isa == kernels::Isa::kAvx512) return RAVENCAL_ISA_AVX512;
  return isa >= kernels::Isa::kAvx2 ? RAVENCAL_ISA_AVX2 : RAVENCAL_ISA_BASELINE;
#endif
}

}  // namespace

class ModelLoader {
 public:
  ModelLoader(const ravencal_config& config, LoadFailure& failure) noexcept
      : config_(config), failure_(failure), isa_(kernels::best_isa(isa_limit(config.max_isa))) {}

  LoadedModel* load(const char* path) noexcept {
    BlobMemory blob;
    const BlobMemory::Status status = blob.read(path, failure_.message);
    if (status == BlobMemory::Status::kUntrusted) {
      failure_.code = RAVENCAL_ERROR_TRUST;  // the sentence is there
      return nullptr;
    }
    if (status == BlobMemory::Status::kUnreadable) {
      return refuse(RAVENCAL_ERROR_IO, "%s: cannot be opened and read", path);
    }
    if (status == BlobMemory::Status::kNoMemory) {
      return refuse(RAVENCAL_ERROR_MEMORY, "%s: no memory to read it into", path);
    }
    const model::BlobCheck check = BlobView::open(blob.bytes(), view_);
    if (!check.ok()) {
      return refuse(RAVENCAL_ERROR_BLOB, "%s: %s (byte %zu)", path, describe(check.status),
                    check.offset);
    }
    if (!admit(view_, path, config_, failure_) || !check_inputs(path) || !map(path)) {
      return nullptr;
    }
    fill();
    model_->info_.memory_locked = model_->info_.memory_locked != 0 && blob.locked() ? 1 : 0;
    model_->blob_ = blob.release();
    if (!self_test(path)) {
      free_model(model_);
      return nullptr;
    }
    return model_;
  }

 private:
  template <typename... Arguments>
  LoadedModel* refuse(std::int32_t code, const char* format, Arguments... arguments) noexcept {
    failure_.say(code, format, arguments...);
    return nullptr;
  }

  /// The plugin works on whole control cycles: a lag of k rows is this many of them.
  [[nodiscard]] std::uint64_t lag_ticks(std::uint32_t lag_rows) const noexcept {
    const double ticks = static_cast<double>(lag_rows) * view_.row_period_s() * 1e9 /
                         static_cast<double>(config_.tick_ns);
    return static_cast<std::uint64_t>(std::llround(ticks));
  }

  /// Of a GRU's window, whose rows are at least a tick apart.
  [[nodiscard]] std::uint32_t ticks_per_row() const noexcept {
    const std::uint64_t ticks = lag_ticks(1);
    constexpr std::uint64_t kMost = 10'000;
    return static_cast<std::uint32_t>(ticks < 1 ? 1 : (ticks < kMost ? ticks : kMost));
  }

  bool check_inputs(const char* path) noexcept {
    for (std::size_t i = 0; i < view_.feature_count(); ++i) {
      const model::BlobFeature feature = view_.feature(i);
      if (feature.catalogue_index >= core::kCatalogueSize) {
        refuse(RAVENCAL_ERROR_FEATURES, "%s: input '%.*s' is not part of a RAVEN-II state", path,
               static_cast<int>(feature.channel.size()), feature.channel.data());
        return false;
      }
      const std::uint64_t ticks = lag_ticks(feature.lag_rows);
      if (ticks > longest_lag_ticks_) longest_lag_ticks_ = ticks;
      has_lags_ = has_lags_ || feature.transform == model::Transform::kLag;
      const std::size_t states = model::FeatureState::states_of(feature.transform);
      if (states > states_per_input_) states_per_input_ = states;
      add_channel(feature.catalogue_index);
    }
    if (longest_lag_ticks_ > kMaxMappingBytes / sizeof(float) / channel_count_) {
      refuse(RAVENCAL_ERROR_MEMORY, "%s: an input %llu cycles old needs too much memory", path,
             static_cast<unsigned long long>(longest_lag_ticks_));
      return false;
    }
    return true;
  }

  void add_channel(std::uint16_t catalogue_index) noexcept {
    std::uint16_t& channel = channel_of_[catalogue_index];
    if (channel == 0) channel = static_cast<std::uint16_t>(++channel_count_);
  }

  bool map(const char* path) noexcept {
    Layout counting(nullptr);
    lay_out(counting);
    const std::size_t bytes = counting.used();
    // Private anonymous memory, touched by MAP_POPULATE: no page fault is left for the first step.
    void* const memory = bytes > kMaxMappingBytes
                             ? MAP_FAILED
                             : ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE,
                                      MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
    if (memory == MAP_FAILED) {
      refuse(RAVENCAL_ERROR_MEMORY, "%s: cannot map %zu bytes of memory", path, bytes);
      return false;
    }
    const bool locked = ::mlock(memory, bytes) == 0;
    Layout real(static_cast<std::byte*>(memory));
    lay_out(real);
    model_->mapping_bytes_ = bytes;
    model_->info_.memory_locked = locked ? 1 : 0;
    return true;
  }

  /// The one place that says what a model's memory holds, and in which order.
  void lay_out(Layout& layout) noexcept {
    const std::size_t inputs = view_.feature_count();
    const std::size_t history_rows = has_lags_ ? longest_lag_ticks_ + 1 : 0;
    const auto model = layout.take<LoadedModel>(1);
    const auto readers = layout.take<ChannelReader>(channel_count_);
    const auto channels = layout.take<float>(channel_count_);
    const auto ops = layout.take<model::FeatureOp>(inputs);
    const auto features = layout.take<float>(inputs);
    const auto lowest = layout.take<float>(inputs);
    const auto highest = layout.take<float>(inputs);
    const auto mean = layout.take<float>(inputs);
    const auto inverse_scale = layout.take<float>(inputs);
    const auto scaled =
        layout.take<float>(model::packed::padded(view_.feature_count(), model::packed::kLineLanes));
    const auto below = layout.take<float>(inputs);
    const auto above = layout.take<float>(inputs);
    const auto scratch =
        layout.take<std::byte>(kernels::scratch_bytes(view_.network().header().widest) +
                               kernels::memory_bytes(view_.network(), ticks_per_row()));
    feature_memory_ = layout.take<float>(model::FeatureState::memory_floats(
        inputs, states_per_input_, history_rows, channel_count_));
    if (model.empty()) return;
    model_ = model.data();
    model_->readers_ = readers;
    model_->channels_ = channels;
    model_->ops_ = ops;
    model_->features_ = features;
    model_->lowest_ = lowest;
    model_->highest_ = highest;
    model_->mean_ = mean;
    model_->inverse_scale_ = inverse_scale;
    model_->scaled_ = scaled;
    model_->scratch_ = scratch;
    model_->doubtful_below_ = below;
    model_->doubtful_above_ = above;
  }

  void fill() noexcept {
    LoadedModel& m = *model_;
    const bool needs_cycle_end = fill_readers();
    for (std::size_t i = 0; i < view_.feature_count(); ++i) fill_input(i);
    m.feature_state_ = model::FeatureState(m.ops_, channel_count_, feature_memory_);
    fill_network();
    fill_trust();
    fill_info(needs_cycle_end);
  }

  /// One reader for channels that lie side by side. Returns whether one reads the cycle before.
  bool fill_readers() noexcept {
    std::array<std::uint16_t, core::kCatalogueSize> index_of{};
    for (std::size_t index = 0; index < core::kCatalogueSize; ++index) {
      if (channel_of_[index] != 0)
        index_of[channel_of_[index] - std::size_t{1}] = static_cast<std::uint16_t>(index);
    }
    bool needs_cycle_end = false;
    std::size_t used = 0;
    for (std::size_t channel = 0; channel < channel_count_; ++channel) {
      const ChannelReader reader = reader_of(index_of[channel]);
      needs_cycle_end = needs_cycle_end || reader.latched;
      if (used > 0 && model_->readers_[used - 1].goes_on_with(reader)) {
        ++model_->readers_[used - 1].count;
      } else {
        model_->readers_[used++] = reader;
      }
    }
    model_->readers_ = model_->readers_.first(used);
    return needs_cycle_end;
  }

  /// Of the channels that the model reads.
  [[nodiscard]] std::uint32_t channel_number(const model::BlobFeature& feature) const noexcept {
    return static_cast<std::uint32_t>(channel_of_[feature.catalogue_index] - 1);
  }

  void fill_input(std::size_t i) noexcept {
    const model::BlobFeature feature = view_.feature(i);
    const std::uint64_t lag = lag_ticks(feature.lag_rows);
    model_->ops_[i] = {channel_number(feature), feature.transform, static_cast<std::uint32_t>(lag),
                       feature.play_half_width};
    if (model::is_travel_mean(feature.transform)) {
      model_->ops_[i].travel = feature.travel_si;
      model_->ops_[i].along = channel_number(view_.feature(feature.along));
    }
    if (model::is_mean(feature.transform)) {
      model_->ops_[i].gain = model::mean_gain(static_cast<double>(config_.tick_ns) * 1e-9,
                                              static_cast<double>(feature.time_constant_s));
    }
    const double low = view_.input_min(i);
    const double high = view_.input_max(i);
    const model::InputLimits limits = model::input_limits(low, high);
    model_->lowest_[i] = limits.low;
    model_->highest_[i] = limits.high;
    model_->mean_[i] = static_cast<float>(view_.input_mean(i));
    model_->inverse_scale_[i] = static_cast<float>(1.0 / view_.input_scale(i));
    // A constant says nothing about where the model is valid: the network always sees the constant.
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const double width = high - low;
    const double margin =
        width * (is_position(feature.catalogue_index) ? kPositionMargin : kOtherMargin);
    model_->doubtful_below_[i] = width > 0.0 ? static_cast<float>(low - margin) : -kInfinity;
    model_->doubtful_above_[i] = width > 0.0 ? static_cast<float>(high + margin) : kInfinity;
  }

  void fill_network() noexcept {
    LoadedModel& m = *model_;
    m.network_ = view_.network();
    m.forward_ = kernels::forward_for(isa_);
    const model::packed::PackedLayer gru = m.network_.recurrence();
    if (gru.window != 0) {
      m.window_ticks_ = (gru.window - std::size_t{1}) * gru.stride_rows * ticks_per_row();
    }
    kernels::clear_memory(m.network_, ticks_per_row(), m.scratch_.data());
    m.output_count_ = view_.output_count();
    for (std::size_t j = 0; j < m.output_count_; ++j) {
      m.joint_of_output_[j] = view_.output(j).slot;
      m.output_mean_[j] = static_cast<float>(view_.output_mean(j));
      m.output_scale_[j] = static_cast<float>(view_.output_scale(j));
      const std::uint8_t joint = m.joint_of_output_[j];
      m.constant_ji_[joint] = constant_ji(config_, joint, m.output_mean_[j]);
      m.largest_ji_[joint] = largest_ji(config_, joint, m.output_mean_[j], m.output_scale_[j]);
    }
  }

  void fill_trust() noexcept {
    LoadedModel::Trust& trust = model_->trust_;
    trust.rank = view_.trust_rank();
    if (trust.rank == 0) return;
    trust.directions = view_.trust_directions();
    for (std::size_t k = 0; k < trust.rank; ++k) {
      trust.inverse_variance[k] = view_.trust_inverse_variance(k);
    }
    trust.inverse_residual_variance = view_.trust_inverse_residual_variance();
    trust.none_distance = view_.trust_none_distance();
    trust.per_width = 1.0F / (view_.trust_none_distance() - view_.trust_full_distance());
    trust.per_input = 1.0F / static_cast<float>(view_.feature_count());
  }

  void fill_info(bool needs_cycle_end) noexcept {
    ravencal_info& info = model_->info_;
    info.struct_size = sizeof info;
    info.isa = abi_isa(isa_);
    info.inputs = view_.feature_count();
    info.padded_inputs = static_cast<std::uint32_t>(
        model::packed::padded(view_.feature_count(), model::packed::kLineLanes));
    info.precision = static_cast<std::uint32_t>(view_.precision());
    for (std::size_t l = 0; l < view_.layer_count(); ++l) {
      const model::packed::PackedLayer layer = view_.network().layer(l);
      info.parameters += std::uint64_t{layer.inputs} * layer.outputs + layer.outputs;
    }
    info.bytes_per_step = view_.bytes_per_step();
    info.longest_lag_ticks = static_cast<std::uint32_t>(longest_lag_ticks_);
    info.checksum = view_.checksum();
    info.needs_cycle_end = needs_cycle_end ? 1 : 0;
    info.is_signed = is_signature_checked(view_, config_) ? 1 : 0;
    info.arm = static_cast<std::uint32_t>(view_.arm());
    info.coordinates = static_cast<std::uint32_t>(view_.coordinates());
    copy_text(view_.robot(), info.robot);
    copy_text(view_.controller(), info.controller);
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      info.constant_ji[j] = model_->constant_ji_[j];
    }
  }

  template <std::size_t kRoom>
  static void copy_text(std::string_view text, char (&to)[kRoom]) noexcept {
    const std::size_t length = text.size() < kRoom - 1 ? text.size() : kRoom - 1;
    std::memcpy(to, text.data(), length);
    to[length] = '\0';
  }

  /// Outputs of the features at hand; a GRU sees them held over its window, at a tick per row.
  std::array<float, RAVENCAL_JOINTS> run_held() noexcept {
    const model::packed::PackedLayer gru = model_->network_.recurrence();
    const std::uint32_t passes = gru.window == 0 ? 1 : (gru.window - 1U) * gru.stride_rows + 1U;
    kernels::clear_memory(model_->network_, 1, model_->scratch_.data());
    std::array<float, RAVENCAL_JOINTS> outputs{};
    model_->scale_inputs();
    for (std::uint32_t pass = 0; pass < passes; ++pass) model_->run_network(outputs);
    return outputs;
  }

  /// The kernels must reproduce the blob's own vectors. This test finds a wrong compiler,
  /// instruction set or layout before it moves a robot.
  bool self_test(const char* path) noexcept {
    for (std::size_t row = 0; row < view_.self_test_count(); ++row) {
      for (std::size_t i = 0; i < view_.feature_count(); ++i) {
        model_->features_[i] = view_.self_test_input(row, i);
      }
      const std::array<float, RAVENCAL_JOINTS> outputs = run_held();
      for (std::size_t j = 0; j < view_.output_count(); ++j) {
        const double difference = static_cast<double>(outputs[j]) - view_.self_test_output(row, j);
        const double tolerance = view_.self_test_tolerance(j);
        if (!(difference <= tolerance && difference >= -tolerance)) {
          refuse(RAVENCAL_ERROR_SELF_TEST, "%s: self-test %zu, output %zu: off by %g, allowed %g",
                 path, row, j, difference, tolerance);
          return false;
        }
      }
    }
    kernels::clear_memory(model_->network_, ticks_per_row(), model_->scratch_.data());
    return true;
  }

  const ravencal_config& config_;
  LoadFailure& failure_;
  BlobView view_;
  std::array<std::uint16_t, core::kCatalogueSize> channel_of_{};  ///< 1 + channel, 0 if unused
  std::size_t channel_count_ = 0;
  std::uint64_t longest_lag_ticks_ = 0;
  bool has_lags_ = false;
  std::size_t states_per_input_ = 1;
  kernels::Isa isa_;
  LoadedModel* model_ = nullptr;
  std::span<float> feature_memory_;
};

LoadedModel* load_model(const char* path, const ravencal_config& config,
                        LoadFailure& failure) noexcept {
  return ModelLoader(config, failure).load(path);
}

void free_model(LoadedModel* model) noexcept {
  if (model == nullptr) return;
  BlobMemory::free(model->blob_);
  ::munmap(model, model->mapping_bytes_);
}

}  // namespace ravencal::rt
