// SPDX-License-Identifier: Apache-2.0
//
// The plain way: fixed-size Eigen, compiled for this machine, over one aligned block of weights.
#include <Eigen/Core>

#include "bench/step_peers.hpp"

namespace ravencal::bench {
namespace {

template <int kInputs, int kOutputs, int... kRest>
void run(const float* weights, const float* x, float* outputs) {
  using Weights = Eigen::Matrix<float, kOutputs, kInputs>;
  using X = Eigen::Matrix<float, kInputs, 1>;
  using Y = Eigen::Matrix<float, kOutputs, 1>;
  constexpr std::size_t kSize = kernels::padded(std::size_t{kInputs} * kOutputs, 16);
  const Eigen::Map<const Weights, Eigen::Aligned64> w(weights);
  const Eigen::Map<const Y, Eigen::Aligned64> b(weights + kSize);
  alignas(64) Y y;
  y.noalias() = w * Eigen::Map<const X>(x);
  y += b;
  if constexpr (sizeof...(kRest) > 0) {
    y = y.array().logistic().matrix();
    run<kOutputs, kRest...>(weights + kSize + kernels::padded(kOutputs, 16), y.data(), outputs);
  } else {
    Eigen::Map<Y>{outputs} = y;
  }
}

}  // namespace

Peer eigen_peer(const Task& task) {
  const kernels_test::Network& network = task.network;
  std::size_t floats = 0;
  for (const auto& layer : network) {
    floats += kernels::padded(layer.weights.size(), 16) + kernels::padded(layer.outputs, 16);
  }
  const std::shared_ptr<std::byte[]> block = kernels_test::aligned_bytes(floats * sizeof(float));
  auto* at = reinterpret_cast<float*>(block.get());
  for (const auto& layer : network) {
    for (std::size_t o = 0; o < layer.outputs; ++o) {
      for (std::size_t i = 0; i < layer.inputs; ++i) {
        at[i * layer.outputs + o] = layer.weights[o * layer.inputs + i];
      }
    }
    at += kernels::padded(layer.weights.size(), 16);
    std::copy(layer.biases.begin(), layer.biases.end(), at);
    at += kernels::padded(layer.outputs, 16);
  }
  const auto* weights = reinterpret_cast<const float*>(block.get());
  Peer peer{"Eigen, fixed-size f32", float32_bytes(network), {}, {}, {}};
  if (network.size() == 4 && network[0].inputs == 208 && network[0].outputs == 600) {
    peer.step = [block, weights, x = task.inputs.data()](float* y) {
      run<208, 600, 500, 400, 3>(weights, x, y);
    };
  } else if (network.size() == 4 && network[0].inputs == 112 && network[0].outputs == 128) {
    peer.step = [block, weights, x = task.inputs.data()](float* y) {
      run<112, 128, 64, 32, 3>(weights, x, y);
    };
  } else {
    peer.skipped = "only the two built-in networks are compiled";
  }
  return peer;
}

}  // namespace ravencal::bench
