// SPDX-License-Identifier: Apache-2.0
#include "conversion/window.hpp"

#include "model/scaled_inputs.hpp"
#include "model/single_precision.hpp"

namespace ravencal::conversion {
namespace {

template <typename Scalar>
using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

constexpr float kLargestInput = 32767.0F;  // of a quantised input, in steps (packed_network.hpp)

bool has_gru(const model::CalibrationModel& model) {
  return model.layers.size() > 1 && model.layers[1].kind == model::packed::LayerKind::kGruRecurrent;
}

/// State behind a window of scaled samples, oldest first, each [features x rows], from zero.
template <typename Scalar>
Matrix<Scalar> state_behind(const model::CalibrationModel& model,
                            std::span<const Matrix<Scalar>> scaled) {
  const model::DenseLayer& projection = model.layers[0];
  const model::DenseLayer& recurrence = model.layers[1];
  const Matrix<Scalar> from_inputs = projection.weights.cast<Scalar>();
  const Matrix<Scalar> from_state = recurrence.weights.cast<Scalar>();
  const Eigen::Index units = from_state.cols();
  const Eigen::Index block = from_state.rows() / 3;
  Matrix<Scalar> state = Matrix<Scalar>::Zero(units, scaled.front().cols());
  for (const Matrix<Scalar>& sample : scaled) {
    Matrix<Scalar> x = from_inputs * sample;
    x.colwise() += projection.biases.cast<Scalar>();
    Matrix<Scalar> h = from_state * state;
    h.colwise() += recurrence.biases.cast<Scalar>();
    const auto rows = [&](Matrix<Scalar>& values, Eigen::Index gate) {
      return values.middleRows(gate * block, units).array();
    };
    const Matrix<Scalar> update = (rows(x, 0) + rows(h, 0)).logistic();
    const Matrix<Scalar> reset = (rows(x, 1) + rows(h, 1)).logistic();
    const Matrix<Scalar> candidate = (rows(x, 2) + reset.array() * rows(h, 2)).tanh();
    state =
        update.cwiseProduct(state) + (Scalar(1) - update.array()).matrix().cwiseProduct(candidate);
  }
  return state;
}

/// The layers behind the GRU as a model of its state.
model::CalibrationModel behind_gru(const model::CalibrationModel& model) {
  model::CalibrationModel tail = model;
  const Eigen::Index units = model.layers[1].weights.cols();
  tail.layers.erase(tail.layers.begin(), tail.layers.begin() + 2);
  tail.features.resize(static_cast<std::size_t>(units));
  tail.input = {Eigen::VectorXd::Zero(units), Eigen::VectorXd::Ones(units)};
  tail.input_min = Eigen::VectorXd::Constant(units, -1.0);
  tail.input_max = Eigen::VectorXd::Constant(units, 1.0);
  return tail;
}

/// [features x rows], as the network sees them.
Eigen::MatrixXf scaled_in_single(const model::CalibrationModel& model,
                                 const Eigen::MatrixXf& sample) {
  const Eigen::MatrixXf scaled = model::scaled_inputs<float>(model, sample.transpose());
  const float step = model.layers.front().input_step;
  if (!(step > 0.0F)) return scaled;
  return (scaled.array() / step).rint().max(-kLargestInput).min(kLargestInput) * step;
}

}  // namespace

std::size_t window_of(const model::CalibrationModel& model) {
  return has_gru(model) ? model.layers[1].window : 1;
}

Eigen::MatrixXd predict_exact(const model::CalibrationModel& model,
                              std::span<const Eigen::MatrixXf> samples) {
  if (!has_gru(model)) return model.predict(samples.back().cast<double>());
  std::vector<Eigen::MatrixXd> scaled;
  for (const Eigen::MatrixXf& sample : samples) {
    scaled.push_back(model::scaled_inputs<double>(model, sample.transpose().cast<double>()));
  }
  return behind_gru(model).predict(state_behind<double>(model, scaled).transpose());
}

Eigen::MatrixXd predict_packed(const model::CalibrationModel& weights,
                               std::span<const Eigen::MatrixXf> samples) {
  if (!has_gru(weights)) {
    return model::predict_single(weights, samples.back().transpose()).transpose().cast<double>();
  }
  std::vector<Eigen::MatrixXf> scaled;
  for (const Eigen::MatrixXf& sample : samples) scaled.push_back(scaled_in_single(weights, sample));
  return model::predict_single(behind_gru(weights), state_behind<float>(weights, scaled))
      .transpose()
      .cast<double>();
}

}  // namespace ravencal::conversion
