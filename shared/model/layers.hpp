// SPDX-License-Identifier: Apache-2.0
//
// The arithmetic of a network, written once: training (batches of columns) and CalibrationModel
// (double or float) call these templates; the plugin's kernels are tested against them. No
// allocation as long as the result has its final size and does not alias the input.
#pragma once

#include <Eigen/Core>

#include "model/kinds.hpp"

namespace ravencal::model {

/// scaled = (value - mean) * inverse_scale, per row; `values` is [features x samples].
template <typename Mean, typename InverseScale, typename Values, typename Scaled>
void standardise(const Eigen::MatrixBase<Mean>& mean,
                 const Eigen::MatrixBase<InverseScale>& inverse_scale,
                 const Eigen::MatrixBase<Values>& values, Eigen::MatrixBase<Scaled>& scaled) {
  scaled.derived() = ((values.colwise() - mean).array().colwise() * inverse_scale.array()).matrix();
}

/// value = scaled * scale + mean, per row; in place.
template <typename Mean, typename Scale, typename Values>
void unstandardise(const Eigen::MatrixBase<Mean>& mean, const Eigen::MatrixBase<Scale>& scale,
                   Eigen::MatrixBase<Values>& values) {
  values.derived() = (values.array().colwise() * scale.array()).matrix().colwise() + mean;
}

/// Applies the activation to every element, in place. sigmoid(z) = 1 / (1 + exp(-z)).
template <typename Sums>
void activate(Activation activation, Eigen::MatrixBase<Sums>& sums) {
  auto&& z = sums.derived().array();
  switch (activation) {
    case Activation::kLinear:
      return;
    case Activation::kSigmoid:
      z = z.logistic();
      return;
    case Activation::kTanh:
      z = z.tanh();
      return;
    case Activation::kRelu:
      z = z.max(typename Sums::Scalar(0));
      return;
  }
}

/// y = activation(weights * x + biases); weights [outputs x inputs], x [inputs x samples],
/// y [outputs x samples]. y must not overlap x.
template <typename Weights, typename Biases, typename X, typename Y>
void dense(const Eigen::MatrixBase<Weights>& weights, const Eigen::MatrixBase<Biases>& biases,
           Activation activation, const Eigen::MatrixBase<X>& x, Eigen::MatrixBase<Y>& y) {
  y.derived().noalias() = weights.derived() * x.derived();
  y.derived().colwise() += biases.derived();
  activate(activation, y);
}

/// State [units x samples] of a GRU (packed_network.hpp) behind `window` samples that are all `x`
/// [inputs x samples], from zero. input_weights [3 * block x inputs], recurrent_weights
/// [3 * block x units], block >= units; biases likewise.
template <typename Scalar>
Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> gru_held(
    const Eigen::MatrixXf& input_weights, const Eigen::VectorXf& input_biases,
    const Eigen::MatrixXf& recurrent_weights, const Eigen::VectorXf& recurrent_biases, int window,
    const Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>& x) {
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  const Eigen::Index units = recurrent_weights.cols();
  const Eigen::Index block = recurrent_weights.rows() / 3;
  const Matrix recurrent = recurrent_weights.cast<Scalar>();
  Matrix from_input = input_weights.cast<Scalar>() * x;
  from_input.colwise() += input_biases.cast<Scalar>();
  Matrix state = Matrix::Zero(units, x.cols());
  for (int sample = 0; sample < window; ++sample) {
    Matrix from_state = recurrent * state;
    from_state.colwise() += recurrent_biases.cast<Scalar>();
    const auto gate = [&](Eigen::Index g) {
      return (from_input.middleRows(g * block, units) + from_state.middleRows(g * block, units))
          .array()
          .logistic();
    };
    const Matrix update = gate(0).matrix();
    const Matrix candidate = (from_input.middleRows(2 * block, units).array() +
                              gate(1) * from_state.middleRows(2 * block, units).array())
                                 .tanh()
                                 .matrix();
    state = (candidate.array() + update.array() * (state - candidate).array()).matrix();
  }
  return state;
}

}  // namespace ravencal::model
