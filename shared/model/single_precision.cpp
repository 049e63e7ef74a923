// SPDX-License-Identifier: Apache-2.0
#include "model/single_precision.hpp"

#include "model/layers.hpp"
#include "model/scaled_inputs.hpp"

namespace ravencal::model {

Eigen::MatrixXf predict_single(const CalibrationModel& model, const Eigen::MatrixXf& features_si) {
  Eigen::MatrixXf x = scaled_inputs<float>(model, features_si);
  for (const DenseLayer& layer : model.layers) {
    // The kernels keep a GRU's state in f32.
    const bool rounds = layer.input_step > 0.0F && layer.kind != packed::LayerKind::kGruRecurrent;
    if (rounds) {
      constexpr float kMaxUnits = 32767.0F;
      x = (x.array() / layer.input_step).rint().max(-kMaxUnits).min(kMaxUnits) * layer.input_step;
    }
    if (layer.kind == packed::LayerKind::kGruInput) continue;  // with the next one
    if (layer.kind == packed::LayerKind::kGruRecurrent) {
      const DenseLayer& first = *(&layer - 1);
      x = gru_held<float>(first.weights, first.biases, layer.weights, layer.biases, layer.window,
                          x);
      continue;
    }
    Eigen::MatrixXf y(layer.weights.rows(), x.cols());
    dense(layer.weights, layer.biases, layer.activation, x, y);
    x = std::move(y);
  }
  const Eigen::VectorXf output_mean = model.output.mean.cast<float>();
  const Eigen::VectorXf output_scale = model.output.scale.cast<float>();
  unstandardise(output_mean, output_scale, x);
  return x;
}

}  // namespace ravencal::model
