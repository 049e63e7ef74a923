// SPDX-License-Identifier: Apache-2.0
#include "bench/step_peers.hpp"

#if defined(RAVENCAL_BENCH_RTNEURAL)
#include <RTNeural/RTNeural.h>
#endif

namespace ravencal::bench {

#if defined(RAVENCAL_BENCH_RTNEURAL)

/// RTNeural's run-time Model: its ModelT keeps weights in fixed-size members, which Eigen refuses
/// beyond 128 KiB.
Peer rtneural_peer(const Task& task) {
  const kernels_test::Network& network = task.network;
  auto model = std::make_shared<RTNeural::Model<float>>(static_cast<int>(network.front().inputs));
  for (const auto& layer : network) {
    const int outputs = static_cast<int>(layer.outputs);
    auto* dense = new RTNeural::Dense<float>(static_cast<int>(layer.inputs), outputs);
    std::vector<std::vector<float>> weights(layer.outputs);
    for (std::size_t o = 0; o < layer.outputs; ++o) {
      const auto* row = layer.weights.data() + o * layer.inputs;
      weights[o].assign(row, row + layer.inputs);
    }
    dense->setWeights(weights);
    dense->setBias(layer.biases.data());
    model->addLayer(dense);
    if (&layer != &network.back()) {
      model->addLayer(new RTNeural::SigmoidActivation<float>(outputs));
    }
  }
  model->reset();
  const std::size_t outputs = network.back().outputs;
  auto step = [model, outputs, x = task.inputs.data()](float* y) {
    model->forward(x);
    std::copy_n(model->getOutputs(), outputs, y);
  };
  return {"RTNeural Model f32", float32_bytes(network), step, {}, {}};
}

#else

Peer rtneural_peer(const Task& /*task*/) {
  return {"RTNeural", 0, {}, {}, "not found when this was built (RTNeural/RTNeural.h)"};
}

#endif

}  // namespace ravencal::bench
