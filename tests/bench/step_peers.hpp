// SPDX-License-Identifier: Apache-2.0
//
// What bench_step compares: each peer runs the same network on the same inputs. A peer that the
// build or the machine does not have says so instead.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bench/step_reference.hpp"
#include "unit/kernels_network.hpp"

namespace ravencal::bench {

struct Peer {
  std::string name;
  std::size_t weight_bytes = 0;  ///< read by one step
  /// The timed part: outputs [outputs of the network], unscaled.
  std::function<void(float* outputs)> step;
  std::function<void()> prepare;  ///< before every step, not timed; may be empty
  std::string skipped;            ///< why there is no step, if there is none
  /// What the step ought to give; nothing where only its time matters.
  std::optional<Reference> reference = std::nullopt;
  std::string about = {};  ///< what the peer is made of, if its name does not say
};

/// One network and one sample for every peer.
struct Task {
  kernels_test::Network network;
  std::vector<float> inputs;  ///< scaled, within [-0.9, 0.9]: the middle of a trained range
};

/// Random weights and inputs of a fixed seed; `shape`: inputs, units of each layer, outputs.
inline Task make_task(const std::vector<std::uint32_t>& shape) {
  std::mt19937 random(1);
  Task task{kernels_test::paper_like_network(shape, random), std::vector<float>(shape.front())};
  std::uniform_real_distribution<float> uniform(-0.9F, 0.9F);
  for (float& input : task.inputs) input = uniform(random);
  return task;
}

/// ravencal_api::step of the loaded plugin, everything included (clock, checks, gather, network,
/// envelope, telemetry), with config.max_isa = RAVENCAL_ISA_*.
Peer plugin_peer(const Task& task, kernels::Precision precision, std::uint32_t isa);
/// The plugin's network alone, with its best instruction set, in the memory that the plugin uses.
Peer kernel_peer(const Task& task, kernels::Precision precision);
/// The authors' second model, one tick of 1 ms of it, as kernel_peer: GRU of 300 units over 8
/// samples 50 ms apart, dense 300, 3 outputs, random weights.
Peer gru_peer(kernels::Precision precision);
/// Reads as many bytes as fast as one core can: the bandwidth of the level that they come from.
Peer bound_peer(std::size_t bytes);

Peer eigen_peer(const Task& task);
Peer onnx_runtime_peer(const Task& task);
Peer torch_peer(const Task& task);
/// The BLAS that LibTorch was configured with, of at::show_config()'s text; "unknown" if it does
/// not say.
std::string blas_of(std::string_view torch_config);
Peer rtneural_peer(const Task& task);

inline std::size_t float32_bytes(const kernels_test::Network& network) {
  std::size_t floats = 0;
  for (const auto& layer : network) floats += layer.weights.size() + layer.biases.size();
  return floats * sizeof(float);
}

}  // namespace ravencal::bench
