// SPDX-License-Identifier: Apache-2.0
#include "model/packed_network.hpp"

#include <bit>

namespace ravencal::model::packed {
namespace {

bool known(const PackedLayer& layer) noexcept {
  return layer.activation <= Activation::kRelu && layer.precision <= Precision::kInt8 &&
         (!has_few_outputs(layer) || layer.precision == Precision::kFloat32) &&
         layer.reserved == 0 && layer.inputs > 0 && layer.inputs <= kMaxWidth &&
         layer.outputs > 0 && layer.outputs <= kMaxWidth;
}

/// The sections lie where pack() puts them, one after another from `at`.
bool in_place(const PackedLayer& layer, std::uint64_t at) noexcept {
  const std::uint64_t lane_bytes = padded(layer.outputs, kLineLanes) * 4;
  const bool scaled = layer.precision == Precision::kInt8 && !has_few_outputs(layer);
  const std::uint64_t scales_at = scaled ? at + lane_bytes : 0;
  const std::uint64_t sums_at = scaled ? at + 2 * lane_bytes : 0;
  const std::uint64_t weights_at = at + (scaled ? 3 : 1) * lane_bytes;
  const bool step_ok =
      scaled ? layer.input_step > 1e-30F && layer.input_step < 1e30F : layer.input_step == 0.0F;
  return step_ok && layer.biases_at == at && layer.row_scales_at == scales_at &&
         layer.row_sums_at == sums_at && layer.weights_at == weights_at &&
         layer.end == weights_at + padded(weight_bytes(layer), kLineBytes);
}

template <typename T>
T load(const std::byte* at) noexcept {
  T value;
  std::memcpy(&value, at, sizeof(value));
  return value;
}

bool finite(float value) noexcept { return value - value == 0.0F; }

float from_bfloat16(std::uint16_t upper_half) noexcept {
  return std::bit_cast<float>(static_cast<std::uint32_t>(upper_half) << 16U);
}

std::size_t element_bytes(const PackedLayer& layer) noexcept {
  if (layer.precision == Precision::kInt8) return 1;
  return layer.precision == Precision::kBfloat16 ? 2 : 4;
}

BadValue bad_value(std::size_t at, bool in_padding) noexcept { return {true, in_padding, at}; }

/// The checks of find_bad_value() within one layer.
class LayerCheck {
 public:
  LayerCheck(const PackedView& view, const PackedLayer& layer) noexcept
      : view_(view), layer_(layer) {}

  BadValue run() const noexcept {
    const std::size_t lanes = padded(layer_.outputs, kLineLanes);
    for (std::size_t o = 0; o < lanes; ++o) {
      const BadValue bad = check_lane(o);
      if (bad.found) return bad;
    }
    const std::size_t rows = has_few_outputs(layer_) ? layer_.outputs : lanes;
    for (std::size_t o = 0; o < rows; ++o) {
      const BadValue bad = check_weights(o);
      if (bad.found) return bad;
    }
    return check_zero(layer_.weights_at + weight_bytes(layer_), layer_.end);
  }

 private:
  BadValue check_zero(std::size_t from, std::size_t to) const noexcept {
    for (std::size_t at = from; at < to; ++at) {
      if (view_.base[at] != std::byte{0}) return bad_value(at, true);
    }
    return {};
  }

  BadValue check_lane(std::size_t o) const noexcept {
    const std::size_t bias_at = layer_.biases_at + 4 * o;
    const std::size_t scale_at = layer_.row_scales_at + 4 * o;
    const bool is_padding = o >= layer_.outputs;
    if (is_padding) {
      const BadValue bias = check_zero(bias_at, bias_at + 4);
      if (bias.found || layer_.precision != Precision::kInt8) return bias;
      return check_zero(scale_at, scale_at + 4);
    }
    if (!finite(load<float>(view_.base + bias_at))) return bad_value(bias_at, false);
    if (layer_.precision != Precision::kInt8) return {};
    // The largest weight of the row, as f32, must be a number too.
    const auto scale = load<float>(view_.base + scale_at);
    const float largest = scale / layer_.input_step * static_cast<float>(kMaxWeightUnits);
    return scale > 0.0F && finite(largest) ? BadValue{} : bad_value(scale_at, false);
  }

  BadValue check_weights(std::size_t o) const noexcept {
    const std::size_t group = has_few_outputs(layer_) ? kLineLanes : inputs_side_by_side(layer_);
    const std::size_t size = element_bytes(layer_);
    std::int32_t sum = 0;
    std::int32_t magnitude = 0;
    for (std::size_t i = 0; i < padded(layer_.inputs, group); ++i) {
      const std::size_t at = layer_.weights_at + element_index(layer_, o, i) * size;
      if (o >= layer_.outputs || i >= layer_.inputs) {
        const BadValue padding = check_zero(at, at + size);
        if (padding.found) return padding;
      } else if (layer_.precision == Precision::kInt8) {
        const auto units = static_cast<std::int32_t>(load<std::int8_t>(view_.base + at));
        if (units < -kMaxWeightUnits) return bad_value(at, false);
        sum += units;
        magnitude += units < 0 ? -units : units;
      } else if (!finite(layer_.precision == Precision::kBfloat16
                             ? from_bfloat16(load<std::uint16_t>(view_.base + at))
                             : load<float>(view_.base + at))) {
        return bad_value(at, false);
      }
    }
    if (layer_.precision != Precision::kInt8) return {};
    const std::size_t sum_at = layer_.row_sums_at + 4 * o;
    const bool sums = load<std::int32_t>(view_.base + sum_at) == sum && magnitude <= kMaxRowUnits;
    return sums ? BadValue{} : bad_value(sum_at, o >= layer_.outputs);
  }

  const PackedView& view_;
  const PackedLayer& layer_;
};

}  // namespace

float PackedView::weight(const PackedLayer& layer, std::size_t output,
                         std::size_t input) const noexcept {
  const std::byte* const at =
      base + layer.weights_at + element_index(layer, output, input) * element_bytes(layer);
  if (layer.precision == Precision::kFloat32) return load<float>(at);
  if (layer.precision == Precision::kBfloat16) return from_bfloat16(load<std::uint16_t>(at));
  const float unit = load<float>(base + layer.row_scales_at + 4 * output) / layer.input_step;
  return static_cast<float>(load<std::int8_t>(at)) * unit;
}

float PackedView::bias(const PackedLayer& layer, std::size_t output) const noexcept {
  return load<float>(base + layer.biases_at + 4 * output);
}

BadValue find_bad_value(const PackedView& view) noexcept {
  for (std::uint32_t l = 0; l < view.header().layers; ++l) {
    const PackedLayer layer = view.layer(l);
    const BadValue bad = LayerCheck(view, layer).run();
    if (bad.found) return bad;
  }
  return {};
}

bool open(const std::byte* base, std::size_t bytes, PackedView& view) noexcept {
  if (reinterpret_cast<std::uintptr_t>(base) % kLineBytes != 0) return false;
  return open_anywhere(base, bytes, view);
}

bool open_anywhere(const std::byte* base, std::size_t bytes, PackedView& view) noexcept {
  if (base == nullptr) return false;
  if (bytes < sizeof(PackedHeader)) return false;
  const PackedView candidate{base};
  const PackedHeader header = candidate.header();
  if (header.layers == 0 || header.layers > kMaxLayers || header.bytes != bytes) return false;
  for (const std::uint8_t reserved : header.reserved) {
    if (reserved != 0) return false;
  }
  std::uint64_t at = sizeof(PackedHeader) + std::uint64_t{header.layers} * sizeof(PackedLayer);
  if (bytes < at) return false;
  std::size_t widest = 0;
  for (std::uint32_t l = 0; l < header.layers; ++l) {
    const PackedLayer layer = candidate.layer(l);
    if (!known(layer) || !in_place(layer, at)) return false;
    const PackedLayer before = candidate.layer(l > 0 ? l - 1 : 0);
    if (!follows(layer, l > 0 ? &before : nullptr)) return false;
    if (l + 1 == header.layers && layer.kind != LayerKind::kDense) return false;
    at = layer.end;
    const std::size_t width = layer.inputs > layer.outputs ? layer.inputs : layer.outputs;
    if (padded(width, kLineLanes) > widest) widest = padded(width, kLineLanes);
  }
  if (at != bytes || header.widest != widest) return false;
  view = candidate;
  return true;
}

}  // namespace ravencal::model::packed
