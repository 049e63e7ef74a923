// SPDX-License-Identifier: Apache-2.0
#include "model/pack.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace ravencal::model::packed {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr float kMaxInputUnits = 32767.0F;

float weight(const LayerSource& layer, std::size_t output, std::size_t input) {
  const float value = layer.weights[static_cast<std::ptrdiff_t>(output) * layer.row_stride +
                                    static_cast<std::ptrdiff_t>(input) * layer.column_stride];
  return std::fpclassify(value) == FP_SUBNORMAL ? 0.0F : value;
}

PackedLayer describe(const LayerSource& source, Precision precision, std::uint64_t at) {
  PackedLayer layer = {};
  layer.inputs = source.inputs;
  layer.outputs = source.outputs;
  layer.activation = source.activation;
  layer.kind = source.kind;
  layer.window = source.window;
  layer.stride_rows = source.stride_rows;
  layer.precision = has_few_outputs(layer) ? Precision::kFloat32 : precision;
  const std::uint64_t lane_bytes = padded(source.outputs, kLineLanes) * 4;
  layer.biases_at = at;
  layer.weights_at = at + lane_bytes;
  if (layer.precision == Precision::kInt8) {
    layer.input_step = source.input_limit / kMaxInputUnits;
    layer.row_scales_at = at + lane_bytes;
    layer.row_sums_at = at + 2 * lane_bytes;
    layer.weights_at = at + 3 * lane_bytes;
  }
  layer.end = layer.weights_at + padded(weight_bytes(layer), kLineBytes);
  return layer;
}

bool finite(const LayerSource& layer) {
  if (!(layer.input_limit > 0.0F) || !std::isfinite(layer.input_limit)) return false;
  for (std::size_t o = 0; o < layer.outputs; ++o) {
    if (!std::isfinite(layer.biases[o])) return false;
    for (std::size_t i = 0; i < layer.inputs; ++i) {
      if (!std::isfinite(weight(layer, o, i))) return false;
    }
  }
  for (std::size_t i = 0; layer.input_means != nullptr && i < layer.inputs; ++i) {
    if (!std::isfinite(layer.input_means[i])) return false;
  }
  return true;
}

void pack_float32(const LayerSource& source, const PackedLayer& layer, float* out) {
  for (std::size_t o = 0; o < layer.outputs; ++o) {
    for (std::size_t i = 0; i < layer.inputs; ++i) {
      const std::size_t at = element_index(layer, o, i);
      out[at] = weight(source, o, i);
    }
  }
}

/// Upper 16 bits of `value`, rounded to nearest, ties to even.
std::uint16_t to_bfloat16(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  return static_cast<std::uint16_t>((bits + 0x7FFFU + ((bits >> 16U) & 1U)) >> 16U);
}

bool pack_bfloat16(const LayerSource& source, const PackedLayer& layer, std::uint16_t* out) {
  constexpr std::uint16_t kExponent = 0x7F80;
  for (std::size_t o = 0; o < layer.outputs; ++o) {
    for (std::size_t i = 0; i < layer.inputs; ++i) {
      const std::uint16_t rounded = to_bfloat16(weight(source, o, i));
      if ((rounded & kExponent) == kExponent) return false;
      out[element_index(layer, o, i)] = rounded;
    }
  }
  return true;
}

std::int64_t units_of_row(const LayerSource& source, std::size_t o, float scale) {
  std::int64_t units = 0;
  for (std::size_t i = 0; i < source.inputs; ++i) {
    units += std::abs(std::lrint(weight(source, o, i) / scale));
  }
  return units;
}

/// Smallest scale that keeps every weight within 127 units and the row within kMaxRowUnits.
float row_scale(const LayerSource& source, std::size_t o) {
  float largest = 0.0F;
  for (std::size_t i = 0; i < source.inputs; ++i) {
    largest = std::max(largest, std::abs(weight(source, o, i)));
  }
  float scale = std::max(largest / static_cast<float>(kMaxWeightUnits), 1e-30F);
  while (units_of_row(source, o, scale) > kMaxRowUnits) scale *= 1.01F;
  return scale;
}

void pack_int8(const LayerSource& source, const PackedLayer& layer, std::byte* block) {
  auto* scales = reinterpret_cast<float*>(block + layer.row_scales_at);
  auto* sums = reinterpret_cast<std::int32_t*>(block + layer.row_sums_at);
  auto* biases = reinterpret_cast<float*>(block + layer.biases_at);
  auto* out = reinterpret_cast<std::int8_t*>(block + layer.weights_at);
  for (std::size_t o = 0; o < layer.outputs; ++o) {
    const float scale = row_scale(source, o);
    for (std::size_t i = 0; i < layer.inputs; ++i) {
      const auto units = static_cast<std::int8_t>(
          std::clamp(std::lrint(weight(source, o, i) / scale), -127L, 127L));
      sums[o] += units;
      out[element_index(layer, o, i)] = units;
      if (source.input_means != nullptr) {
        const float lost = weight(source, o, i) - static_cast<float>(units) * scale;
        biases[o] += lost * source.input_means[i];
      }
    }
    scales[o] = scale * layer.input_step;
  }
}

bool pack_layer(const LayerSource& source, const PackedLayer& layer, std::byte* block) {
  std::memcpy(block + layer.biases_at, source.biases, source.outputs * sizeof(float));
  std::byte* const weights = block + layer.weights_at;
  switch (layer.precision) {
    case Precision::kFloat32:
      pack_float32(source, layer, reinterpret_cast<float*>(weights));
      return true;
    case Precision::kBfloat16:
      return pack_bfloat16(source, layer, reinterpret_cast<std::uint16_t*>(weights));
    case Precision::kInt8:
      pack_int8(source, layer, block);
      return true;
  }
  return false;
}

}  // namespace

std::size_t packed_bytes(std::span<const LayerSource> layers, Precision precision) noexcept {
  if (layers.empty() || layers.size() > kMaxLayers) return 0;
  std::uint64_t at = sizeof(PackedHeader) + layers.size() * sizeof(PackedLayer);
  PackedLayer before = {};
  for (const LayerSource& source : layers) {
    const bool sized = source.inputs > 0 && source.inputs <= kMaxWidth && source.outputs > 0 &&
                       source.outputs <= kMaxWidth;
    if (!sized) return 0;
    const PackedLayer layer = describe(source, precision, at);
    if (!follows(layer, &source == layers.data() ? nullptr : &before)) return 0;
    at = layer.end;
    before = layer;
  }
  return before.kind == LayerKind::kDense ? at : 0;
}

bool pack(std::span<const LayerSource> layers, Precision precision,
          std::span<std::byte> block) noexcept {
  const std::size_t bytes = packed_bytes(layers, precision);
  if (bytes == 0 || block.size() != bytes) return false;
  if (!std::all_of(layers.begin(), layers.end(), finite)) return false;
  std::memset(block.data(), 0, block.size());
  PackedHeader header = {};
  header.layers = static_cast<std::uint32_t>(layers.size());
  header.bytes = bytes;
  std::uint64_t at = sizeof(PackedHeader) + layers.size() * sizeof(PackedLayer);
  for (std::size_t l = 0; l < layers.size(); ++l) {
    const PackedLayer layer = describe(layers[l], precision, at);
    std::memcpy(block.data() + sizeof(header) + l * sizeof(layer), &layer, sizeof(layer));
    if (!pack_layer(layers[l], layer, block.data())) return false;
    const auto wide =
        static_cast<std::uint32_t>(padded(std::max(layer.inputs, layer.outputs), kLineLanes));
    header.widest = std::max(header.widest, wide);
    at = layer.end;
  }
  std::memcpy(block.data(), &header, sizeof(header));
  return true;
}

}  // namespace ravencal::model::packed
