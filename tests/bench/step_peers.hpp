// SPDX-License-Identifier: Apache-2.0
//
// What bench_step compares: each peer runs the same network. A peer that the build did not find
// says so instead.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "unit/kernels_network.hpp"

namespace ravencal::bench {

struct Peer {
  std::string name;
  std::size_t weight_bytes = 0;
  std::function<void(const float*, float*)> step;
  std::string skipped;             ///< why there is no step, if there is none
  bool runs_these_weights = true;  ///< false: a network of the same sizes
};

/// A whole step of the loaded plugin: gather, checks, network, envelope, cycle end.
Peer plugin_peer(const kernels_test::Network& network, kernels::Precision precision);

Peer eigen_peer(const kernels_test::Network& network);
Peer torch_peer(const kernels_test::Network& network);
Peer rtneural_peer(const kernels_test::Network& network);

inline std::size_t float32_bytes(const kernels_test::Network& network) {
  std::size_t floats = 0;
  for (const auto& layer : network) floats += layer.weights.size() + layer.biases.size();
  return floats * sizeof(float);
}

}  // namespace ravencal::bench
