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

}  // namespace ravencal::model
