// SPDX-License-Identifier: Apache-2.0
//
// GRU networks for the kernels' tests and benchmark: random weights, the window in double, and
// packed blocks with their memory.
#pragma once

#include "unit/kernels_network.hpp"

namespace ravencal::kernels_test {

/// The authors' second model: 300 units over 8 samples 50 ms apart, then a layer of 300.
struct GruShape {
  std::uint32_t inputs = 208;
  std::uint32_t units = 300;
  std::uint8_t window = 8;
  std::uint32_t stride_rows = 5;  ///< of 10 ms
  std::uint32_t hidden = 300;
};

struct GruNetwork {
  GruShape shape;
  Network layers;  ///< input projection and recurrence, padded as packed_network.hpp says; dense
};

/// Three blocks of `units` rows, each padded to whole lines with rows of zeros.
inline Layer random_gates(std::uint32_t inputs, std::uint32_t units, std::mt19937& random) {
  const auto block = static_cast<std::uint32_t>(kernels::padded(units, kernels::kLineLanes));
  Layer layer{inputs, 3 * block, Activation::kLinear, {}, {}};
  layer.weights.resize(std::size_t{layer.outputs} * inputs);
  layer.biases.resize(layer.outputs);
  std::normal_distribution<float> normal(0.0F, 1.0F / std::sqrt(static_cast<float>(inputs)));
  for (std::size_t row = 0; row < layer.outputs; ++row) {
    if (row % block >= units) continue;
    for (std::size_t i = 0; i < inputs; ++i) layer.weights[row * inputs + i] = normal(random);
    layer.biases[row] = normal(random);
  }
  return layer;
}

inline GruNetwork random_gru(const GruShape& shape, std::uint32_t seed) {
  std::mt19937 random(seed);
  GruNetwork network{shape, {}};
  network.layers.push_back(random_gates(shape.inputs, shape.units, random));
  network.layers.push_back(random_gates(shape.units, shape.units, random));
  for (Layer& layer : paper_like_network({shape.units, shape.hidden, 3}, random)) {
    network.layers.push_back(std::move(layer));
  }
  return network;
}

/// Outputs behind a window of samples, oldest first, from a state of zero.
inline std::vector<double> reference_gru(const GruNetwork& network,
                                         const std::vector<std::vector<float>>& window) {
  const auto product = [](const Layer& layer, const std::vector<double>& x) {
    std::vector<double> y(layer.biases.begin(), layer.biases.end());
    for (std::size_t o = 0; o < layer.outputs; ++o) {
      for (std::size_t i = 0; i < layer.inputs; ++i) {
        y[o] += static_cast<double>(layer.weights[o * layer.inputs + i]) * x[i];
      }
    }
    return y;
  };
  const std::size_t units = network.shape.units;
  const std::size_t block = network.layers[0].outputs / 3;
  std::vector<double> state(units, 0.0);
  for (const std::vector<float>& sample : window) {
    const auto x = product(network.layers[0], {sample.begin(), sample.end()});
    const auto h = product(network.layers[1], state);
    for (std::size_t i = 0; i < units; ++i) {
      const double update = reference_activation(Activation::kSigmoid, x[i] + h[i]);
      const double reset = reference_activation(Activation::kSigmoid, x[block + i] + h[block + i]);
      const double candidate = std::tanh(x[2 * block + i] + reset * h[2 * block + i]);
      state[i] = update * state[i] + (1.0 - update) * candidate;
    }
  }
  for (std::size_t l = 2; l < network.layers.size(); ++l) {
    state = product(network.layers[l], state);
    for (double& value : state) {
      value = reference_activation(network.layers[l].activation, value);
    }
  }
  return state;
}

inline std::vector<kernels::LayerSource> gru_sources(const GruNetwork& network) {
  std::vector<kernels::LayerSource> layers = sources(network.layers, 1.0F);
  layers[0].kind = kernels::LayerKind::kGruInput;
  layers[1].kind = kernels::LayerKind::kGruRecurrent;
  layers[1].window = network.shape.window;
  layers[1].stride_rows = network.shape.stride_rows;
  return layers;
}

/// A packed GRU network with its scratch and its own memory.
class PackedGru {
 public:
  PackedGru(const GruNetwork& network, Precision precision, std::uint32_t ticks_per_row) {
    const auto layers = gru_sources(network);
    bytes_ = kernels::packed_bytes(layers, precision);
    block_ = aligned_bytes(bytes_);
    ok_ = bytes_ > 0 && kernels::pack(layers, precision, {block_.get(), bytes_}) &&
          kernels::open(block_.get(), bytes_, view_);
    if (!ok_) return;
    scratch_ = aligned_bytes(kernels::scratch_bytes(view_.header().widest) +
                             kernels::memory_bytes(view_, ticks_per_row));
    kernels::clear_memory(view_, ticks_per_row, scratch_.get());
    outputs_ = network.layers.back().outputs;
  }

  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  std::vector<float> run(kernels::Isa isa, const std::vector<float>& inputs) {
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
