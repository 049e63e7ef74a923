// SPDX-License-Identifier: Apache-2.0
#include "bench/step_peers.hpp"

#if defined(RAVENCAL_BENCH_TORCH)
#include <torch/torch.h>
#endif

namespace ravencal::bench {

#if defined(RAVENCAL_BENCH_TORCH)

Peer torch_peer(const Task& task) {
  const kernels_test::Network& network = task.network;
  at::set_num_threads(1);
  struct Dense {
    at::Tensor weights;  ///< transposed: [inputs x outputs]
    at::Tensor biases;
    at::Tensor y;
  };
  auto layers = std::make_shared<std::vector<Dense>>();
  for (const auto& layer : network) {
    const auto rows = static_cast<std::int64_t>(layer.outputs);
    const auto columns = static_cast<std::int64_t>(layer.inputs);
    layers->push_back(
        {torch::from_blob(const_cast<float*>(layer.weights.data()), {rows, columns}).clone().t(),
         torch::from_blob(const_cast<float*>(layer.biases.data()), {1, rows}).clone(),
         torch::empty({1, rows})});
  }
  const auto input = torch::empty({1, static_cast<std::int64_t>(network.front().inputs)});
  auto step = [layers, input, x = task.inputs.data()](float* y) {
    const at::InferenceMode guard;
    std::copy_n(x, input.numel(), input.data_ptr<float>());
    const at::Tensor* value = &input;
    for (auto& layer : *layers) {
      at::addmm_out(layer.y, layer.biases, *value, layer.weights);
      if (&layer != &layers->back()) layer.y.sigmoid_();
      value = &layer.y;
    }
    std::copy_n(value->data_ptr<float>(), value->numel(), y);
  };
  return {"LibTorch ATen f32", float32_bytes(network), step, {}, {}};
}

#else

Peer torch_peer(const Task& /*task*/) {
  return {"LibTorch", 0, {}, {}, "not found when this was built (package libtorch-dev)"};
}

#endif

}  // namespace ravencal::bench
