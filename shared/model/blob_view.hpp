// SPDX-License-Identifier: Apache-2.0
//
// Reads a weight blob in place. open() checks every byte that has a rule; a view that was opened
// successfully can be read without further checks. No exceptions, no allocation: the real-time
// plugin and the tools use the same code. The bytes are borrowed. Nothing here needs them aligned;
// the kernels, which run packed_network() in place, need them on a 64-byte line.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "model/blob_format.hpp"
#include "model/blob_status.hpp"
#include "model/kinds.hpp"
#include "model/packed_network.hpp"

namespace ravencal::model {

struct BlobFeature {
  std::uint16_t catalogue_index = blob::kNoCatalogueIndex;  ///< core/catalogue.hpp, or none
  Transform transform = Transform::kValue;
  std::uint32_t lag_rows = 0;
  float play_half_width = 0.0F;  ///< of a play, SI unit of the channel
  float time_constant_s = 0.0F;  ///< of a mean over time
  float travel_si = 0.0F;        ///< length of a mean over travel, SI unit of the position
  std::uint32_t along = 0;       ///< the input that is the position of a mean over travel
  std::string_view channel;
};

/// Loop gains and margins (model/loop_gains.hpp says what they mean), as the header has them.
struct BlobLoop {
  bool gains_known = false;
  bool margins_known = false;
  std::uint32_t rows = 0;         ///< over which the largest gains were taken
  float gain_margin = 0.0F;       ///< factor; blob::kMaxGainMargin stands for infinity
  float phase_margin_rad = 0.0F;  ///< at most pi
};

struct BlobOutput {
  std::uint8_t slot = blob::kNoSlot;  ///< core::JointSlot, or none
  std::string_view joint;
  std::string_view estimate_channel;
  std::string_view unit;
};

class BlobView {
 public:
  /// Validates `bytes` and points `view` at them. On refusal `view` is unchanged.
  static BlobCheck open(std::span<const std::byte> bytes, BlobView& view) noexcept;

  [[nodiscard]] std::uint32_t feature_count() const noexcept { return features_; }
  [[nodiscard]] std::uint32_t layer_count() const noexcept { return layers_; }
  [[nodiscard]] std::uint32_t output_count() const noexcept { return outputs_; }
  [[nodiscard]] std::uint32_t self_test_count() const noexcept { return self_tests_; }
  [[nodiscard]] double row_period_s() const noexcept;
  [[nodiscard]] std::size_t file_bytes() const noexcept { return bytes_.size(); }
  [[nodiscard]] std::uint32_t checksum() const noexcept;
  /// Whether there is a signature; open() does not verify it (model/blob_signature.hpp does).
  [[nodiscard]] bool is_signed() const noexcept;
  /// What a signature covers: every byte before it.
  [[nodiscard]] std::span<const std::byte> signed_bytes() const noexcept;
  [[nodiscard]] std::span<const std::byte> signature() const noexcept;

  // Origin (model/origin.hpp). Unknown and empty in blobs of version 2.0.
  [[nodiscard]] Arm arm() const noexcept;
  [[nodiscard]] Coordinates coordinates() const noexcept;
  [[nodiscard]] std::string_view robot() const noexcept;
  [[nodiscard]] std::string_view controller() const noexcept;

  [[nodiscard]] BlobLoop loop() const noexcept;
  /// SI unit of output `j` per standard deviation of the group's channels; 0 if not known.
  [[nodiscard]] float loop_gain(LoopGroup group, std::size_t j) const noexcept;

  [[nodiscard]] BlobFeature feature(std::size_t i) const noexcept;
  [[nodiscard]] double input_mean(std::size_t i) const noexcept;
  [[nodiscard]] double input_scale(std::size_t i) const noexcept;
  [[nodiscard]] double input_min(std::size_t i) const noexcept;
  [[nodiscard]] double input_max(std::size_t i) const noexcept;

  /// As asked for when it was packed; layers of few outputs are f32 in any case.
  [[nodiscard]] packed::Precision precision() const noexcept;
  /// Layers, weights and biases, as the kernels read them.
  [[nodiscard]] packed::PackedView network() const noexcept;
  [[nodiscard]] std::span<const std::byte> network_bytes() const noexcept;
  /// What one step reads: the network, the scaling in single precision, and the trust section.
  [[nodiscard]] std::size_t bytes_per_step() const noexcept;

  // Joint distance of the inputs from the training set (trust_region.hpp says what the numbers
  // mean). Rank 0: the blob has none, and the confidence is always 1.
  [[nodiscard]] std::uint32_t trust_rank() const noexcept { return trust_rank_; }
  [[nodiscard]] float trust_inverse_residual_variance() const noexcept;
  [[nodiscard]] float trust_inverse_variance(std::size_t k) const noexcept;
  [[nodiscard]] float trust_direction(std::size_t k, std::size_t i) const noexcept;
  /// For kernels: trust_rank() rows of packed::padded(feature_count(), 16) f32, padded with zeros,
  /// on a 64-byte line if the file is. Null for rank 0.
  [[nodiscard]] const float* trust_directions() const noexcept;
  [[nodiscard]] float trust_full_distance() const noexcept;
  [[nodiscard]] float trust_none_distance() const noexcept;

  [[nodiscard]] BlobOutput output(std::size_t j) const noexcept;
  [[nodiscard]] double output_mean(std::size_t j) const noexcept;
  [[nodiscard]] double output_scale(std::size_t j) const noexcept;

  /// Largest difference, in the output's SI unit, that another arithmetic order may cause.
  [[nodiscard]] double self_test_tolerance(std::size_t j) const noexcept;
  [[nodiscard]] float self_test_input(std::size_t row, std::size_t i) const noexcept;
  [[nodiscard]] double self_test_output(std::size_t row, std::size_t j) const noexcept;

  /// JSON object with string values.
  [[nodiscard]] std::string_view provenance() const noexcept;

 private:
  friend class BlobValidator;

  [[nodiscard]] bool has_appended() const noexcept;
  [[nodiscard]] const std::byte* section(blob::Section section) const noexcept;
  [[nodiscard]] std::string_view text(std::size_t at, std::size_t capacity) const noexcept;

  std::span<const std::byte> bytes_;
  std::uint32_t features_ = 0;
  std::uint32_t layers_ = 0;
  std::uint32_t outputs_ = 0;
  std::uint32_t self_tests_ = 0;
  std::uint32_t trust_rank_ = 0;
};

}  // namespace ravencal::model
