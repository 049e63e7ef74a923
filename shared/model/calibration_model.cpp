// SPDX-License-Identifier: Apache-2.0
#include "model/calibration_model.hpp"

#include "model/layers.hpp"
#include "model/scaled_inputs.hpp"

namespace ravencal::model {

Eigen::MatrixXd CalibrationModel::predict(const Eigen::MatrixXd& features_si) const {
  Eigen::MatrixXd values = scaled_inputs<double>(*this, features_si.transpose());
  for (const DenseLayer& layer : layers) {
    if (layer.kind == packed::LayerKind::kGruInput) continue;  // with the next one
    if (layer.kind == packed::LayerKind::kGruRecurrent) {
      const DenseLayer& first = *(&layer - 1);
      values = gru_held<double>(first.weights, first.biases, layer.weights, layer.biases,
                                layer.window, values);
      continue;
    }
    const Eigen::MatrixXd weights = layer.weights.cast<double>();
    const Eigen::VectorXd biases = layer.biases.cast<double>();
    Eigen::MatrixXd sums(layer.weights.rows(), values.cols());
    dense(weights, biases, layer.activation, values, sums);
    values = std::move(sums);
  }
  unstandardise(output.mean, output.scale, values);
  return values.transpose();
}

}  // namespace ravencal::model
