// SPDX-License-Identifier: Apache-2.0
#include "learn/shape.hpp"

#include <algorithm>
#include <cmath>

#include "core/random.hpp"

namespace ravencal::learn {
namespace {

/// 64 bytes of float; of double twice that.
constexpr std::ptrdiff_t kPadding = 16;

std::ptrdiff_t padded(std::ptrdiff_t count) { return (count + kPadding - 1) / kPadding * kPadding; }

}  // namespace

Shape::Shape(std::ptrdiff_t inputs, std::span<const std::uint32_t> hidden, std::ptrdiff_t outputs,
             model::Activation activation) {
  const auto append = [&](std::ptrdiff_t width, model::Activation function) {
    LayerShape layer;
    layer.inputs = layers_.empty() ? inputs : layers_.back().outputs;
    layer.outputs = width;
    layer.activation = function;
    layer.weights = parameter_count_;
    layer.biases = layer.weights + padded(layer.inputs * width);
    parameter_count_ = layer.biases + padded(width);
    layers_.push_back(layer);
  };
  for (const std::uint32_t width : hidden) append(width, activation);
  append(outputs, model::Activation::kLinear);
}

std::ptrdiff_t Shape::workspace_size(std::ptrdiff_t samples) const {
  std::ptrdiff_t widest = 0;
  std::ptrdiff_t total = 0;
  for (const LayerShape& layer : layers_) {
    widest = std::max(widest, layer.outputs);
    total += padded(layer.outputs * samples);
  }
  return total + 2 * padded(widest * samples) + padded(samples);  // two deltas, a vector of ones
}

double Shape::training_flops_per_sample() const {
  double flops = 0.0;
  for (std::size_t k = 0; k < layers_.size(); ++k) {
    const double products = static_cast<double>(layers_[k].inputs * layers_[k].outputs);
    flops += 2.0 * products * (k == 0 ? 2.0 : 3.0);
  }
  return flops;
}

std::vector<double> initial_parameters(const Shape& shape, std::uint64_t seed) {
  std::vector<double> parameters(static_cast<std::size_t>(shape.parameter_count()), 0.0);
  core::Random random(seed);
  for (const LayerShape& layer : shape.layers()) {
    const double limit = std::sqrt(6.0 / static_cast<double>(layer.inputs + layer.outputs));
    for (std::ptrdiff_t i = 0; i < layer.inputs * layer.outputs; ++i) {
      parameters[static_cast<std::size_t>(layer.weights + i)] =
          limit * (2.0 * random.uniform() - 1.0);
    }
  }
  return parameters;
}

std::vector<model::DenseLayer> layers_from(const Shape& shape, std::span<const float> parameters) {
  std::vector<model::DenseLayer> layers;
  for (const LayerShape& layer : shape.layers()) {
    model::DenseLayer dense;
    dense.weights = Eigen::Map<const Eigen::MatrixXf>(parameters.data() + layer.weights,
                                                      layer.outputs, layer.inputs);
    dense.biases =
        Eigen::Map<const Eigen::VectorXf>(parameters.data() + layer.biases, layer.outputs);
    dense.activation = layer.activation;
    layers.push_back(std::move(dense));
  }
  return layers;
}

}  // namespace ravencal::learn
