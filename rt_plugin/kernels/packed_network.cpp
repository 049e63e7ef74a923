// SPDX-License-Identifier: Apache-2.0
#include "kernels/packed_network.hpp"

namespace ravencal::kernels {
namespace {

bool known(const PackedLayer& layer) noexcept {
  return layer.activation <= model::Activation::kRelu && layer.precision <= Precision::kInt8 &&
         layer.reserved[0] == 0 && layer.reserved[1] == 0 && layer.reserved_too == 0 &&
         layer.inputs > 0 && layer.inputs <= kMaxWidth && layer.outputs > 0 &&
         layer.outputs <= kMaxWidth;
}

/// The sections lie where pack() puts them, one after another from `at`.
bool in_place(const PackedLayer& layer, std::uint64_t at) noexcept {
  const std::uint64_t lane_bytes = padded(layer.outputs, kLineLanes) * 4;
  const bool scaled = layer.precision == Precision::kInt8 && !has_few_outputs(layer);
  const std::uint64_t scales_at = scaled ? at + lane_bytes : 0;
  const std::uint64_t sums_at = scaled ? at + 2 * lane_bytes : 0;
  const std::uint64_t weights_at = at + (scaled ? 3 : 1) * lane_bytes;
  const bool step_ok = !scaled || (layer.input_step > 0.0F && layer.input_step < 1e30F);
  return step_ok && layer.biases_at == at && layer.row_scales_at == scales_at &&
         layer.row_sums_at == sums_at && layer.weights_at == weights_at &&
         layer.end == weights_at + padded(weight_bytes(layer), kLineBytes);
}

}  // namespace

bool open(const std::byte* base, std::size_t bytes, PackedView& view) noexcept {
  if (base == nullptr || reinterpret_cast<std::uintptr_t>(base) % kLineBytes != 0) return false;
  if (bytes < sizeof(PackedHeader)) return false;
  const PackedView candidate{base};
  const PackedHeader& header = candidate.header();
  if (header.layers == 0 || header.layers > kMaxLayers || header.bytes != bytes) return false;
  std::uint64_t at = sizeof(PackedHeader) + std::uint64_t{header.layers} * sizeof(PackedLayer);
  if (bytes < at) return false;
  std::size_t widest = 0;
  for (std::uint32_t l = 0; l < header.layers; ++l) {
    const PackedLayer& layer = candidate.layer(l);
    if (!known(layer) || !in_place(layer, at)) return false;
    if (l > 0 && candidate.layer(l - 1).outputs != layer.inputs) return false;
    at = layer.end;
    const std::size_t width = layer.inputs > layer.outputs ? layer.inputs : layer.outputs;
    if (padded(width, kLineLanes) > widest) widest = padded(width, kLineLanes);
  }
  if (at != bytes || header.widest != widest) return false;
  view = candidate;
  return true;
}

}  // namespace ravencal::kernels
