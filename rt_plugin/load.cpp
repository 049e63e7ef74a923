// SPDX-License-Identifier: Apache-2.0
//
// From a blob file to a LoadedModel: map the file, check every byte, choose a compiled network, lay
// everything out in one mapping, run the blob's self-test. Nothing of this is real-time.
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <new>

#include "core/catalogue.hpp"
#include "model/blob_view.hpp"
#include "model/input_limits.hpp"
#include "rt_plugin/fp_mode.hpp"
#include "rt_plugin/loaded_model.hpp"

namespace ravencal::rt {
namespace {

using model::BlobView;
using model::NetworkShape;

constexpr std::size_t kAlignment = 64;
constexpr std::size_t kMaxMappingBytes = std::size_t{1} << 28U;

// How far beyond its trained range, in widths of that range, an input may go before the model is
// not believed. Positions: as far as the network may extrapolate (model/input_limits.hpp); farther
// out the error was never measured. Speeds, torques and commands: a whole width, because their
// peaks in unseen motion exceed those of a zig-zag without telling of a new place.
constexpr double kPositionMargin = 0.5;
constexpr double kOtherMargin = 1.0;

std::size_t aligned(std::size_t bytes) {
  return (bytes + kAlignment - 1) / kAlignment * kAlignment;
}

/// A file mapped for reading, unmapped at the end of scope.
class MappedFile {
 public:
  explicit MappedFile(const char* path) noexcept {
    const int file = ::open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) return;
    // lseek, not fstat: fstat has a symbol version that older systems lack.
    const off_t size = ::lseek(file, 0, SEEK_END);
    if (size > 0) {
      void* const memory =
          ::mmap(nullptr, static_cast<std::size_t>(size), PROT_READ, MAP_PRIVATE, file, 0);
      if (memory != MAP_FAILED) {
        bytes_ = {static_cast<const std::byte*>(memory), static_cast<std::size_t>(size)};
      }
    }
    opened_ = size == 0 || !bytes_.empty();
    ::close(file);
  }
  ~MappedFile() {
    if (!bytes_.empty()) ::munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
  }
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  [[nodiscard]] bool opened() const noexcept { return opened_; }
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept { return bytes_; }

 private:
  std::span<const std::byte> bytes_;
  bool opened_ = false;
};

/// Hands out aligned pieces of one block of memory; without a block it only counts bytes.
class Layout {
 public:
  explicit Layout(std::byte* start) noexcept : start_(start) {}

  template <typename T>
  std::span<T> take(std::size_t count) noexcept {
    const std::size_t at = used_;
    used_ += aligned(count * sizeof(T));
    if (start_ == nullptr) return {};
    T* const first = reinterpret_cast<T*>(start_ + at);
    for (std::size_t i = 0; i < count; ++i) new (first + i) T{};
    return {first, count};
  }
  [[nodiscard]] std::size_t used() const noexcept { return used_; }

 private:
  std::byte* start_;
  std::size_t used_ = 0;
};

}  // namespace

class ModelLoader {
 public:
  ModelLoader(const ravencal_config& config, LoadFailure& failure) noexcept
      : config_(config), failure_(failure) {}

  LoadedModel* load(const char* path) noexcept {
    const MappedFile file(path);
    if (!file.opened()) return refuse(RAVENCAL_ERROR_IO, "%s: cannot be opened and read", path);
    const model::BlobCheck check = BlobView::open(file.bytes(), view_);
    if (!check.ok()) {
      return refuse(RAVENCAL_ERROR_BLOB, "%s: %s (byte %zu)", path, describe(check.status),
                    check.offset);
    }
    if (!check_inputs(path) || !check_outputs(path) || !choose_network(path) || !map(path)) {
      return nullptr;
    }
    fill();
    if (!self_test(path)) {
      free_model(model_);
      return nullptr;
    }
    return model_;
  }

 private:
  template <typename... Arguments>
  LoadedModel* refuse(std::int32_t code, const char* format, Arguments... arguments) noexcept {
    failure_.code = code;
    (void)std::snprintf(failure_.message.data(), failure_.message.size(), format, arguments...);
    return nullptr;
  }

  /// The plugin works on whole control cycles: a lag of k rows is this many of them.
  [[nodiscard]] std::uint64_t lag_ticks(std::uint32_t lag_rows) const noexcept {
    const double ticks = static_cast<double>(lag_rows) * view_.row_period_s() * 1e9 /
                         static_cast<double>(config_.tick_ns);
    return static_cast<std::uint64_t>(std::llround(ticks));
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

  bool check_outputs(const char* path) noexcept {
    if (view_.output_count() > RAVENCAL_JOINTS) {
      refuse(RAVENCAL_ERROR_TOPOLOGY, "%s: corrects %u joints; the robot state has %d to correct",
             path, static_cast<unsigned>(view_.output_count()), RAVENCAL_JOINTS);
      return false;
    }
    for (std::size_t j = 0; j < view_.output_count(); ++j) {
      const model::BlobOutput output = view_.output(j);
      if (output.slot >= RAVENCAL_JOINTS) {
        refuse(RAVENCAL_ERROR_FEATURES, "%s: corrects '%.*s', which is not joint 1, 2 or 3", path,
               static_cast<int>(output.joint.size()), output.joint.data());
        return false;
      }
    }
    return true;
  }

  bool choose_network(const char* path) noexcept {
    std::array<std::uint32_t, NetworkShape::kMaxLayers + 1> sizes{};
    if (view_.layer_count() <= NetworkShape::kMaxLayers) {
      sizes[0] = view_.feature_count();
      for (std::size_t l = 0; l < view_.layer_count(); ++l) sizes[l + 1] = view_.layer(l).outputs;
      choice_ = choose_kernel({sizes.data(), view_.layer_count() + std::size_t{1}},
                              best_isa(config_.max_isa));
    }
    if (choice_.kernel == nullptr) {
      refuse(RAVENCAL_ERROR_TOPOLOGY,
             "%s: no compiled network holds %u inputs and %u layers of these sizes; add the "
             "topology to RAVENCAL_TOPOLOGIES and build again",
             path, static_cast<unsigned>(view_.feature_count()),
             static_cast<unsigned>(view_.layer_count()));
      return false;
    }
    return true;
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
    const NetworkShape& shape = choice_.kernel->shape;
    const std::size_t padded_inputs = NetworkShape::to_lines(shape.inputs());
    const std::size_t history_rows = has_lags_ ? longest_lag_ticks_ + 1 : 0;
    const auto model = layout.take<LoadedModel>(1);
    const auto readers = layout.take<ChannelReader>(channel_count_);
    const auto channels = layout.take<float>(channel_count_);
    const auto ops = layout.take<model::FeatureOp>(view_.feature_count());
    const auto features = layout.take<float>(padded_inputs);
    const auto below = layout.take<float>(view_.feature_count());
    const auto above = layout.take<float>(view_.feature_count());
    const auto arena = layout.take<float>(shape.arena_floats());
    feature_memory_ = layout.take<float>(view_.feature_count() + history_rows * channel_count_);
    if (model.empty()) return;
    model_ = model.data();
    model_->readers_ = readers;
    model_->channels_ = channels;
    model_->ops_ = ops;
    model_->features_ = features;
    model_->doubtful_below_ = below;
    model_->doubtful_above_ = above;
    model_->arena_ = arena.data();
    arena_ = arena.data();
  }

  void fill() noexcept {
    LoadedModel& m = *model_;
    m.kernel_ = choice_.kernel;
    bool needs_cycle_end = false;
    for (std::size_t index = 0; index < core::kCatalogueSize; ++index) {
      if (channel_of_[index] == 0) continue;
      ChannelReader& reader = m.readers_[channel_of_[index] - std::size_t{1}];
      reader = reader_of(index);
      needs_cycle_end = needs_cycle_end || reader.latched;
    }
    for (std::size_t i = 0; i < view_.feature_count(); ++i) fill_input(i);
    m.feature_state_ = model::FeatureState(m.ops_, channel_count_, feature_memory_);
    fill_weights();
    m.output_count_ = view_.output_count();
    for (std::size_t j = 0; j < m.output_count_; ++j) m.joint_of_output_[j] = view_.output(j).slot;
    fill_info(needs_cycle_end);
  }

  void fill_input(std::size_t i) noexcept {
    const model::BlobFeature feature = view_.feature(i);
    const std::uint64_t lag = lag_ticks(feature.lag_rows);
    model_->ops_[i] = {static_cast<std::uint32_t>(channel_of_[feature.catalogue_index] - 1),
                       feature.transform, static_cast<std::uint32_t>(lag), feature.play_half_width};
    const NetworkShape& shape = choice_.kernel->shape;
    const double low = view_.input_min(i);
    const double high = view_.input_max(i);
    const model::InputLimits limits = model::input_limits(low, high);
    arena_[shape.low_at() + i] = limits.low;
    arena_[shape.high_at() + i] = limits.high;
    arena_[shape.mean_at() + i] = static_cast<float>(view_.input_mean(i));
    arena_[shape.inverse_scale_at() + i] = static_cast<float>(1.0 / view_.input_scale(i));
    // A constant says nothing about where the model is valid: the network always sees the constant.
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const double width = high - low;
    const double margin =
        width * (is_position(feature.catalogue_index) ? kPositionMargin : kOtherMargin);
    model_->doubtful_below_[i] = width > 0.0 ? static_cast<float>(low - margin) : -kInfinity;
    model_->doubtful_above_[i] = width > 0.0 ? static_cast<float>(high + margin) : kInfinity;
  }

  void fill_weights() noexcept {
    const NetworkShape& shape = choice_.kernel->shape;
    for (std::size_t l = 0; l < view_.layer_count(); ++l) {
      const model::BlobLayer layer = view_.layer(l);
      model_->activations_[l] = layer.activation;
      float* const weights = arena_ + shape.weights_at(l);
      for (std::size_t column = 0; column < layer.inputs; ++column) {
        for (std::size_t row = 0; row < layer.outputs; ++row) {
          weights[column * shape.rows(l) + row] = view_.weight(layer, row, column);
        }
      }
      float* const biases = arena_ + shape.biases_at(l);
      for (std::size_t row = 0; row < layer.outputs; ++row) biases[row] = view_.bias(layer, row);
    }
    for (std::size_t j = 0; j < view_.output_count(); ++j) {
      arena_[shape.output_mean_at() + j] = static_cast<float>(view_.output_mean(j));
      arena_[shape.output_scale_at() + j] = static_cast<float>(view_.output_scale(j));
    }
  }

  void fill_info(bool needs_cycle_end) noexcept {
    ravencal_info& info = model_->info_;
    info.struct_size = sizeof info;
    info.isa = choice_.isa;
    info.inputs = view_.feature_count();
    info.padded_inputs = choice_.kernel->shape.sizes[0];
    for (std::size_t l = 0; l < view_.layer_count(); ++l) {
      const model::BlobLayer layer = view_.layer(l);
      info.parameters += std::uint64_t{layer.inputs} * layer.outputs + layer.outputs;
    }
    info.bytes_per_step = choice_.kernel->shape.arena_floats() * sizeof(float);
    info.longest_lag_ticks = static_cast<std::uint32_t>(longest_lag_ticks_);
    info.checksum = view_.checksum();
    info.needs_cycle_end = needs_cycle_end ? 1 : 0;
  }

  /// The compiled network must reproduce the blob's own vectors: catches a wrong compiler, a wrong
  /// instruction set and a wrong layout before they move a robot.
  bool self_test(const char* path) noexcept {
    const FlushDenormals flush_denormals;
    for (std::size_t row = 0; row < view_.self_test_count(); ++row) {
      for (std::size_t i = 0; i < view_.feature_count(); ++i) {
        model_->features_[i] = view_.self_test_input(row, i);
      }
      std::array<float, RAVENCAL_JOINTS> outputs{};
      model_->kernel_->run(arena_, model_->activations_.data(), model_->features_.data(),
                           outputs.data());
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
    return true;
  }

  const ravencal_config& config_;
  LoadFailure& failure_;
  BlobView view_;
  std::array<std::uint16_t, core::kCatalogueSize> channel_of_{};  ///< 1 + channel, 0 if unused
  std::size_t channel_count_ = 0;
  std::uint64_t longest_lag_ticks_ = 0;
  bool has_lags_ = false;
  KernelChoice choice_;
  LoadedModel* model_ = nullptr;
  float* arena_ = nullptr;
  std::span<float> feature_memory_;
};

LoadedModel* load_model(const char* path, const ravencal_config& config,
                        LoadFailure& failure) noexcept {
  return ModelLoader(config, failure).load(path);
}

void free_model(LoadedModel* model) noexcept {
  if (model != nullptr) ::munmap(model, model->mapping_bytes_);
}

}  // namespace ravencal::rt
