// SPDX-License-Identifier: Apache-2.0
//
// Networks for the kernels' tests and benchmark: random weights, a reference in double, and packed
// blocks that own their memory.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include "kernels/forward.hpp"
#include "model/pack.hpp"

namespace ravencal::kernels_test {

using kernels::Precision;
using model::Activation;

struct Layer {
  std::uint32_t inputs = 0;
  std::uint32_t outputs = 0;
  Activation activation = Activation::kLinear;
  std::vector<float> weights;  ///< row-major [outputs x inputs]
  std::vector<float> biases;
};
using Network = std::vector<Layer>;

/// Weights as a trained network has them: sums of a few units, whatever the width.
inline Network random_network(const std::vector<std::uint32_t>& sizes,
                              const std::vector<Activation>& activations, std::mt19937& random) {
  Network network;
  for (std::size_t l = 0; l + 1 < sizes.size(); ++l) {
    Layer layer{sizes[l], sizes[l + 1], activations[l], {}, {}};
    std::normal_distribution<float> normal(0.0F, 2.0F / std::sqrt(static_cast<float>(sizes[l])));
    layer.weights.resize(std::size_t{layer.inputs} * layer.outputs);
    for (float& weight : layer.weights) weight = normal(random);
    layer.biases.resize(layer.outputs);
    for (float& bias : layer.biases) bias = normal(random);
    network.push_back(std::move(layer));
  }
  return network;
}

/// Sigmoid hidden layers and a linear output, as the paper has them.
inline Network paper_like_network(const std::vector<std::uint32_t>& sizes, std::mt19937& random) {
  std::vector<Activation> activations(sizes.size() - 1, Activation::kSigmoid);
  activations.back() = Activation::kLinear;
  return random_network(sizes, activations, random);
}

inline double reference_activation(Activation activation, double x) {
  switch (activation) {
    case Activation::kLinear:
      return x;
    case Activation::kSigmoid:
      return 1.0 / (1.0 + std::exp(-x));
    case Activation::kTanh:
      return std::tanh(x);
    case Activation::kRelu:
      return x < 0.0 ? 0.0 : x;
  }
  return x;
}

inline std::vector<double> reference_forward(const Network& network,
                                             const std::vector<float>& inputs) {
  std::vector<double> x(inputs.begin(), inputs.end());
  for (const Layer& layer : network) {
    std::vector<double> y(layer.outputs);
    for (std::size_t o = 0; o < layer.outputs; ++o) {
      auto sum = static_cast<double>(layer.biases[o]);
      for (std::size_t i = 0; i < layer.inputs; ++i) {
        sum += static_cast<double>(layer.weights[o * layer.inputs + i]) * x[i];
      }
      y[o] = reference_activation(layer.activation, sum);
    }
    x = std::move(y);
  }
  return x;
}

struct FreeMemory {
  void operator()(std::byte* memory) const { std::free(memory); }
};
using AlignedBytes = std::unique_ptr<std::byte[], FreeMemory>;

inline AlignedBytes aligned_bytes(std::size_t bytes) {
  return AlignedBytes(static_cast<std::byte*>(
      std::aligned_alloc(kernels::kLineBytes, kernels::padded(bytes, kernels::kLineBytes))));
}

inline std::vector<kernels::LayerSource> sources(const Network& network, float input_limit) {
  std::vector<kernels::LayerSource> layers;
  for (const Layer& layer : network) {
    kernels::LayerSource source;
    source.weights = layer.weights.data();
    source.biases = layer.biases.data();
    source.inputs = layer.inputs;
    source.outputs = layer.outputs;
    source.row_stride = layer.inputs;
    source.activation = layer.activation;
    const bool bounded = !layers.empty() && (layers.back().activation == Activation::kSigmoid ||
                                             layers.back().activation == Activation::kTanh);
    source.input_limit = bounded ? 1.0F : input_limit;
    layers.push_back(source);
  }
  return layers;
}

/// A packed network with its scratch memory.
class Packed {
 public:
  Packed(const Network& network, Precision precision, float input_limit = 8.0F) {
    const auto layers = sources(network, input_limit);
    bytes_ = kernels::packed_bytes(layers, precision);
    block_ = aligned_bytes(bytes_);
    ok_ = kernels::pack(layers, precision, {block_.get(), bytes_}) &&
          kernels::open(block_.get(), bytes_, view_);
    if (ok_) scratch_ = aligned_bytes(kernels::scratch_bytes(view_.header().widest));
    outputs_ = network.back().outputs;
  }

  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] std::byte* block() const { return block_.get(); }
  [[nodiscard]] const kernels::PackedView& view() const { return view_; }
  [[nodiscard]] std::byte* scratch() const { return scratch_.get(); }

  [[nodiscard]] std::vector<float> run(kernels::Isa isa, const std::vector<float>& inputs) const {
    std::vector<float> outputs(outputs_);
    kernels::forward_for(isa)(view_, inputs.data(), outputs.data(), scratch_.get());
    return outputs;
  }

 private:
  std::size_t bytes_ = 0;
  AlignedBytes block_;
  AlignedBytes scratch_;
  kernels::PackedView view_;
  std::size_t outputs_ = 0;
  bool ok_ = false;
};

}  // namespace ravencal::kernels_test
