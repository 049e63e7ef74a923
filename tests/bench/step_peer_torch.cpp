// SPDX-License-Identifier: Apache-2.0
#include "bench/step_peers.hpp"

#if defined(RAVENCAL_BENCH_TORCH)
#include <dlfcn.h>
#include <torch/torch.h>
#include <torch/version.h>

#include <filesystem>
#endif

namespace ravencal::bench {

std::string blas_of(std::string_view torch_config) {
  constexpr std::string_view kKey = "BLAS_INFO=";
  const std::size_t at = torch_config.find(kKey);
  if (at == std::string_view::npos) return "unknown";
  const std::string_view value = torch_config.substr(at + kKey.size());
  return std::string(value.substr(0, value.find_first_of(", \n")));
}

#if defined(RAVENCAL_BENCH_TORCH)

namespace {

/// The library whose matrix product runs. Debian's LibTorch asks for any BLAS, and the system's
/// alternatives choose one.
std::string blas_library() {
  Dl_info found{};
  void* const product = ::dlsym(RTLD_DEFAULT, "sgemm_");
  if (product == nullptr || ::dladdr(product, &found) == 0) return "its own";
  std::error_code error;
  return std::filesystem::canonical(found.dli_fname, error).string();
}

}  // namespace

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
  Peer peer{"LibTorch ATen f32", float32_bytes(network), step, {}, {}};
  peer.about = "LibTorch " TORCH_VERSION ", configured with BLAS " + blas_of(at::show_config()) +
               ", runs on " + blas_library();
  return peer;
}

#else

Peer torch_peer(const Task& /*task*/) {
  return {"LibTorch", 0, {}, {}, "not found when this was built (package libtorch-dev)"};
}

#endif

}  // namespace ravencal::bench
