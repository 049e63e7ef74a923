// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace ravencal::bench {

/// The peer: what one writes first. Dynamic Eigen matrices, y = logistic(W x + b), compiled for
/// this machine. No Eigen type in the interface: the two sides are compiled with different flags.
class DynamicNetwork {
 public:
  /// sizes: inputs, hidden ..., outputs. Weights are pseudo-random.
  explicit DynamicNetwork(const std::vector<std::size_t>& sizes);
  ~DynamicNetwork();
  DynamicNetwork(const DynamicNetwork&) = delete;
  DynamicNetwork& operator=(const DynamicNetwork&) = delete;

  void run(std::span<const float> inputs, std::span<float> outputs);

 private:
  struct Impl;
  Impl* impl_;
};

}  // namespace ravencal::bench
