// SPDX-License-Identifier: Apache-2.0
//
// The layout of a network's parameters in one flat, 64-byte aligned array: what the kernels, the
// optimiser and the tile gradients share. Padding between layers is zero and stays zero.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "learn/kernels.hpp"
#include "model/calibration_model.hpp"

namespace ravencal::learn {

/// Fully connected network: `hidden` layers with one activation, then a linear output layer.
class Shape {
 public:
  Shape(std::ptrdiff_t inputs, std::span<const std::uint32_t> hidden, std::ptrdiff_t outputs,
        model::Activation activation);

  [[nodiscard]] std::span<const LayerShape> layers() const { return layers_; }
  [[nodiscard]] std::ptrdiff_t inputs() const { return layers_.front().inputs; }
  [[nodiscard]] std::ptrdiff_t outputs() const { return layers_.back().outputs; }
  /// Scalars of the parameter array, padding included.
  [[nodiscard]] std::ptrdiff_t parameter_count() const { return parameter_count_; }
  /// Scalars that a kernel needs for one tile of `samples`.
  [[nodiscard]] std::ptrdiff_t workspace_size(std::ptrdiff_t samples) const;
  /// Multiply-adds x 2 of one training step per sample: forward, weight gradients, and back
  /// through every layer but the first.
  [[nodiscard]] double training_flops_per_sample() const;

 private:
  std::vector<LayerShape> layers_;
  std::ptrdiff_t parameter_count_ = 0;
};

/// Glorot uniform weights (limit sqrt(6 / (inputs + outputs)), Glorot and Bengio 2010), zero
/// biases. Same seed, same values on every platform. Shape [parameter_count].
std::vector<double> initial_parameters(const Shape& shape, std::uint64_t seed);

/// The network's layers as matrices.
std::vector<model::DenseLayer> layers_from(const Shape& shape, std::span<const float> parameters);

}  // namespace ravencal::learn
