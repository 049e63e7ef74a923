// SPDX-License-Identifier: Apache-2.0
//
// Packs trained layers for the kernels. Not for real time: the tools call it.
#pragma once

#include <cstddef>
#include <span>

#include "model/packed_network.hpp"

namespace ravencal::model::packed {

/// One trained layer, borrowed: y = activation(weights * x + biases).
struct LayerSource {
  const float* weights = nullptr;  ///< [outputs x inputs]
  const float* biases = nullptr;   ///< [outputs]
  std::uint32_t inputs = 0;
  std::uint32_t outputs = 0;
  std::ptrdiff_t row_stride = 0;     ///< floats from one output's weights to the next's
  std::ptrdiff_t column_stride = 1;  ///< floats from one input's weight to the next's
  Activation activation = Activation::kLinear;
  LayerKind kind = LayerKind::kDense;
  std::uint8_t window = 0;        ///< kGruRecurrent, as in PackedLayer
  std::uint32_t stride_rows = 0;  ///< kGruRecurrent, as in PackedLayer
  /// kInt8: the largest magnitude that an input of this layer takes; larger ones are clamped. 1 is
  /// right behind sigmoid and tanh; elsewhere it comes from the trained range.
  float input_limit = 1.0F;
  /// kInt8: mean of each input of this layer over the training data, or null. With it, what the
  /// rounding of weights does to an average input goes into the biases (bias correction: Nagel et
  /// al., "Data-free quantization through weight equalization and bias correction", ICCV 2019).
  const float* input_means = nullptr;
};

/// Bytes that pack() writes, or 0 if the layers do not chain or a size is out of range.
std::size_t packed_bytes(std::span<const LayerSource> layers, Precision precision) noexcept;

/// Writes the packed network; `block` is 64-byte aligned and has packed_bytes(...) bytes. False if
/// it has not, or if a weight, bias or limit is not finite (or, in kBfloat16, rounds to infinity).
/// Weights below the smallest normal number become zero.
bool pack(std::span<const LayerSource> layers, Precision precision,
          std::span<std::byte> block) noexcept;

}  // namespace ravencal::model::packed
