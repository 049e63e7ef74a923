// SPDX-License-Identifier: Apache-2.0
#include "model/packed_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "model/layers.hpp"
#include "model/pack.hpp"
#include "model/scaled_inputs.hpp"

namespace ravencal::model {
namespace {

constexpr std::array<std::string_view, 3> kPrecisionNames = {"f32", "bf16", "int8"};

/// Behind an unbounded activation a layer may see more than the rows at hand showed: inputs beyond
/// the trained range, other motion. Twice as much costs one of 15 bits.
constexpr float kHeadroom = 2.0F;

/// The largest magnitude of a scaled input that the plugin's clamping lets through.
float scaled_limit(const CalibrationModel& model) {
  const ClampedRange range = clamped_range(model);
  Eigen::MatrixXd ends(range.low.size(), 2);
  ends << range.low.cast<double>(), range.high.cast<double>();
  return static_cast<float>(scaled_inputs<double>(model, ends).cwiseAbs().maxCoeff());
}

bool is_bounded(Activation activation) {
  return activation == Activation::kSigmoid || activation == Activation::kTanh;
}

/// [features x rows], rows with a lost value left out.
Eigen::MatrixXf whole_inputs(const CalibrationModel& model, const FeatureMatrix& features_si) {
  std::vector<Eigen::Index> whole;
  for (Eigen::Index row = 0; row < features_si.rows(); ++row) {
    if (features_si.row(row).allFinite()) whole.push_back(row);
  }
  return scaled_inputs<float>(model, features_si(whole, Eigen::all).transpose());
}

}  // namespace

std::string_view name_of(packed::Precision precision) {
  return kPrecisionNames[static_cast<std::size_t>(precision)];
}

core::Result<packed::Precision> precision_of(std::string_view name) {
  const auto* const it = std::find(kPrecisionNames.begin(), kPrecisionNames.end(), name);
  if (it == kPrecisionNames.end()) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("unknown precision '{}'; known: f32, bf16, int8", name)};
  }
  return static_cast<packed::Precision>(it - kPrecisionNames.begin());
}

core::Result<std::vector<LayerInputs>> measure_layer_inputs(const CalibrationModel& model,
                                                            const FeatureMatrix& features_si) {
  const Eigen::MatrixXf first = whole_inputs(model, features_si);
  if (first.cols() == 0)
    return core::data_error("no row has every feature: int8 cannot be calibrated");
  std::vector<LayerInputs> result;
  std::vector<Eigen::VectorXd> sums;
  for (std::size_t l = 0; l < model.layers.size(); ++l) {
    const Eigen::Index inputs = model.layers[l].weights.cols();
    result.push_back({Eigen::VectorXf::Zero(inputs), 0.0F});
    sums.push_back(Eigen::VectorXd::Zero(inputs));
  }
  constexpr Eigen::Index kColumns = 4096;  // bounds the memory of the hidden layers
  for (Eigen::Index column = 0; column < first.cols(); column += kColumns) {
    Eigen::MatrixXf x = first.middleCols(column, std::min(kColumns, first.cols() - column));
    for (std::size_t l = 0; l < model.layers.size(); ++l) {
      sums[l] += x.cast<double>().rowwise().sum();
      result[l].limit = std::max(result[l].limit, x.cwiseAbs().maxCoeff());
      const DenseLayer& layer = model.layers[l];
      if (layer.kind == packed::LayerKind::kGruInput) {
        const DenseLayer& recurrent = model.layers[++l];
        const Eigen::MatrixXf state = gru_held<float>(
            layer.weights, layer.biases, recurrent.weights, recurrent.biases, recurrent.window, x);
        sums[l] += state.cast<double>().rowwise().sum();
        x = state;
        continue;
      }
      Eigen::MatrixXf y(layer.weights.rows(), x.cols());
      dense(layer.weights, layer.biases, layer.activation, x, y);
      x = std::move(y);
    }
  }
  for (std::size_t l = 0; l < model.layers.size(); ++l) {
    result[l].mean = (sums[l] / static_cast<double>(first.cols())).cast<float>();
    const bool is_state = l > 0 && (model.layers[l].kind == packed::LayerKind::kGruRecurrent ||
                                    model.layers[l - 1].kind == packed::LayerKind::kGruRecurrent);
    const bool bounded = is_state || (l > 0 && is_bounded(model.layers[l - 1].activation));
    const float limit = l == 0 ? scaled_limit(model) : bounded ? 1.0F : kHeadroom * result[l].limit;
    result[l].limit = limit > 0.0F ? limit : 1.0F;  // constants only: any limit will do
  }
  return result;
}

core::Result<std::vector<std::byte>> pack_layers(const CalibrationModel& model,
                                                 const Packing& packing) {
  const bool calibrated = packing.inputs.size() == model.layers.size();
  if (packing.precision == packed::Precision::kInt8 && !calibrated) {
    return core::data_error(
        "int8 needs the mean and the largest magnitude of every layer's inputs");
  }
  std::vector<packed::LayerSource> layers;
  for (std::size_t l = 0; l < model.layers.size(); ++l) {
    const DenseLayer& layer = model.layers[l];
    packed::LayerSource source;
    source.weights = layer.weights.data();
    source.biases = layer.biases.data();
    source.inputs = static_cast<std::uint32_t>(layer.weights.cols());
    source.outputs = static_cast<std::uint32_t>(layer.weights.rows());
    source.row_stride = 1;
    source.column_stride = layer.weights.rows();
    source.activation = layer.activation;
    source.kind = layer.kind;
    source.window = layer.window;
    source.stride_rows = layer.stride_rows;
    if (calibrated) {
      source.input_limit = packing.inputs[l].limit;
      // The mean of a GRU's state is not that of its first samples.
      const bool has_mean = layer.kind != packed::LayerKind::kGruRecurrent;
      source.input_means = has_mean ? packing.inputs[l].mean.data() : nullptr;
    }
    layers.push_back(source);
  }
  std::vector<std::byte> bytes(packed::packed_bytes(layers, packing.precision));
  if (bytes.empty()) {
    return core::data_error(fmt::format("a blob holds 1 to {} layers of 1 to {} inputs and outputs",
                                        packed::kMaxLayers, packed::kMaxWidth));
  }
  if (!packed::pack(layers, packing.precision, bytes)) {
    return core::data_error(fmt::format("a weight or bias is not finite, or too large for {}",
                                        name_of(packing.precision)));
  }
  return bytes;
}

core::Result<std::vector<DenseLayer>> unpack_layers(std::span<const std::byte> network) {
  packed::PackedView view;
  if (!packed::open_anywhere(network.data(), network.size(), view)) {
    return core::data_error("not a packed network");
  }
  std::vector<DenseLayer> layers;
  for (std::uint32_t l = 0; l < view.header().layers; ++l) {
    const packed::PackedLayer layer = view.layer(l);
    DenseLayer dense{Eigen::MatrixXf(layer.outputs, layer.inputs),
                     Eigen::VectorXf(layer.outputs),
                     layer.activation,
                     layer.input_step,
                     layer.kind,
                     layer.window,
                     layer.stride_rows};
    for (std::uint32_t o = 0; o < layer.outputs; ++o) {
      dense.biases[o] = view.bias(layer, o);
      for (std::uint32_t i = 0; i < layer.inputs; ++i) {
        dense.weights(o, i) = view.weight(layer, o, i);
      }
    }
    layers.push_back(std::move(dense));
  }
  return layers;
}

}  // namespace ravencal::model
