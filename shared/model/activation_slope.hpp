// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "model/kinds.hpp"

namespace ravencal::model {

/// d activation / d sum where the activation has the value `y`.
inline Eigen::ArrayXXd activation_slope(Activation activation, const Eigen::MatrixXd& y) {
  switch (activation) {
    case Activation::kSigmoid:
      return y.array() * (1.0 - y.array());
    case Activation::kTanh:
      return 1.0 - y.array().square();
    case Activation::kRelu:
      return (y.array() > 0.0).cast<double>();
    case Activation::kLinear:
      break;
  }
  return Eigen::ArrayXXd::Ones(y.rows(), y.cols());
}

}  // namespace ravencal::model
