// SPDX-License-Identifier: Apache-2.0
#include "fuzz/network_promises.hpp"

#include <vector>

namespace ravencal::fuzz {

void promise_chain(const conversion::ForeignModel& model) {
  const conversion::ForeignNetwork& network = model.network;
  promise(network.inputs > 0 && network.outputs > 0 && !network.layers.empty(), "it is a network");
  for (const auto& layer : network.layers) {
    promise(layer.weights.rows() == layer.biases.size(), "a bias for each output");
    promise(layer.weights.allFinite() && layer.biases.allFinite(), "weights are finite");
  }
  if (!network.has_gru) {
    Eigen::Index width = network.inputs;
    for (const auto& layer : network.layers) {
      promise(layer.weights.cols() == width, "a layer takes what the one before it gives");
      width = layer.weights.rows();
    }
    promise(width == network.outputs, "the last layer gives the outputs");
  }
  constexpr Eigen::Index kWidest = 1000;
  if (network.inputs > kWidest) return;
  const std::vector<Eigen::MatrixXd> samples(2, Eigen::MatrixXd::Constant(2, network.inputs, 0.5));
  const auto outputs = model.run(samples);
  promise(!outputs.ok() || outputs->cols() == network.outputs || outputs->cols() == 1,
          "the file gives as many outputs");
}

}  // namespace ravencal::fuzz
