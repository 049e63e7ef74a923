// SPDX-License-Identifier: Apache-2.0
//
// The plugin as a robot loads it: dlopen, a blob in a file, C structs.
#include <Eigen/Core>

#include "bench/step_peers.hpp"
#include "bench/step_settings.hpp"
#include "core/run_level.hpp"
#include "model/blob_writer.hpp"
#include "rt/rig.hpp"
#include "rt_plugin/fp_mode.hpp"
#include "unit/kernels_gru.hpp"

namespace ravencal::bench {
namespace {

/// Small enough for the plugin to accept it; a power of two, so that taking it out rounds nothing.
constexpr double kOutputScale_ji = 0x1p-13;

/// The task's weights in a model that reads a robot's state.
model::CalibrationModel model_of(const Task& task) {
  std::vector<std::uint32_t> hidden;
  for (const auto& layer : task.network) hidden.push_back(layer.outputs);
  hidden.pop_back();
  model::CalibrationModel model = test::make_model(task.network.front().inputs, hidden);
  using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  for (std::size_t l = 0; l < task.network.size(); ++l) {
    const auto& layer = task.network[l];
    model.layers[l].weights =
        Eigen::Map<const RowMajor>(layer.weights.data(), layer.outputs, layer.inputs);
    model.layers[l].biases = Eigen::Map<const Eigen::VectorXf>(layer.biases.data(), layer.outputs);
    model.layers[l].activation = layer.activation;
  }
  model.output.mean.setZero();
  model.output.scale.setConstant(kOutputScale_ji);
  return model;
}

/// Features of test::healthy_state(): the middle of the trained ranges, but for the pedal.
Eigen::VectorXf healthy_features(const model::CalibrationModel& model) {
  Eigen::VectorXf features_si = model.input.mean.cast<float>();
  for (std::size_t i = 0; i < model.features.size(); ++i) {
    if (model.features[i].channel != "runlevel") continue;
    features_si[static_cast<Eigen::Index>(i)] = static_cast<float>(core::kPedalUp);
  }
  return features_si;
}

/// Centres the model so that `features_si` arrive at the network as the task's inputs.
void centre(model::CalibrationModel& model, const Eigen::VectorXf& features_si, const Task& task) {
  const Eigen::Map<const Eigen::VectorXf> inputs(task.inputs.data(), features_si.size());
  model.input.mean =
      features_si.cast<double>() - inputs.cast<double>().cwiseProduct(model.input.scale);
}

constexpr const char* kPrecisionNames[] = {"f32", "bf16", "int8"};

std::string name_of(const char* what, kernels::Precision precision, const std::string& isa) {
  return std::string(what) + kPrecisionNames[static_cast<int>(precision)] + " " + isa;
}

}  // namespace

Peer plugin_peer(const Task& task, kernels::Precision precision, std::uint32_t isa) {
  Peer peer;
  peer.name = name_of("ravencal ", precision, plugin_host::isa_name(isa));
  const auto rig = std::make_shared<test::Rig>(isa);
  model::CalibrationModel model = model_of(task);
  const Eigen::VectorXf features_si = healthy_features(model);
  centre(model, features_si, task);
  const auto blob = test::write_weights(model, peer.name, precision);
  if (const core::Status loaded = rig->instance.load(blob); !loaded.ok()) {
    peer.skipped = loaded.error().message;
    return peer;
  }
  rig->enable();
  rig->tick_until(RAVENCAL_STATE_ACTIVE);
  if (isa != RAVENCAL_ISA_BEST && rig->instance.info().isa != isa) {
    peer.skipped = "this processor does not have it";
    return peer;
  }
  peer.reference = stored_reference(model::read_blob(blob).value(), features_si);
  peer.weight_bytes = rig->instance.info().bytes_per_step;
  peer.prepare = [rig] {
    rig->api().observe_cycle_end(rig->instance.get(), &rig->state);
    rig->state.t_ns += 1'000'000;
  };
  peer.step = [rig](float* outputs) {
    rig->api().step(rig->instance.get(), &rig->state, &rig->output);
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      outputs[j] = rig->output.predicted_ji[j] / static_cast<float>(kOutputScale_ji);
    }
  };
  return peer;
}

Peer kernel_peer(const Task& task, kernels::Precision precision) {
  const kernels::Isa isa = kernels::best_isa();
  const auto packed = std::make_shared<kernels_test::Packed>(task.network, precision);
  const auto block = huge_bytes(packed->bytes());
  std::copy_n(packed->block(), packed->bytes(), block.get());
  kernels::PackedView view;
  kernels::open(block.get(), packed->bytes(), view);
  Peer peer;
  peer.name = name_of("  its network alone, ", precision, kernels::name_of(isa));
  peer.weight_bytes = packed->bytes();
  peer.reference = stored_reference({packed->block(), packed->bytes()}, task.inputs);
  peer.step = [packed, block, view, &task, forward = kernels::forward_for(isa)](float* outputs) {
    const rt::OwnFloatMode own_mode;
    forward(view, task.inputs.data(), outputs, packed->scratch());
  };
  return peer;
}

Peer gru_peer(kernels::Precision precision) {
  constexpr std::uint32_t kTicksPerRow = 10;
  const kernels_test::GruNetwork network = kernels_test::random_gru({}, 1);
  const auto layers = kernels_test::gru_sources(network);
  const std::size_t bytes = kernels::packed_bytes(layers, precision);
  const auto block = huge_bytes(bytes);
  kernels::pack(layers, precision, {block.get(), bytes});
  kernels::PackedView view;
  kernels::open(block.get(), bytes, view);
  const auto scratch = huge_bytes(kernels::scratch_bytes(view.header().widest) +
                                  kernels::memory_bytes(view, kTicksPerRow));
  kernels::clear_memory(view, kTicksPerRow, scratch.get());
  const kernels::Isa isa = kernels::best_isa();
  Peer peer;
  peer.name = name_of("  GRU 300 x 8, ", precision, kernels::name_of(isa));
  peer.weight_bytes = bytes;
  peer.step = [block, view, scratch, inputs = std::vector<float>(network.shape.inputs, 0.3F),
               forward = kernels::forward_for(isa)](float* outputs) {
    const rt::OwnFloatMode own_mode;
    forward(view, inputs.data(), outputs, scratch.get());
  };
  return peer;
}

}  // namespace ravencal::bench
