// SPDX-License-Identifier: Apache-2.0
#include "choice/assemble.hpp"

#include <cmath>

namespace ravencal::choice {
namespace {

using Eigen::Index;

/// The linear functions of all outputs, SI: weights . scaled inputs + constant.
struct LinearParts {
  Eigen::MatrixXd weights;    ///< [outputs x inputs]
  Eigen::VectorXd constants;  ///< [outputs]
};

LinearParts linear_parts(std::span<const Part> parts, Index outputs, Index inputs) {
  LinearParts linear{Eigen::MatrixXd::Zero(outputs, inputs), Eigen::VectorXd::Zero(outputs)};
  for (const Part& part : parts) {
    const Index units = part.basis.weights.rows();
    const auto columns = static_cast<Index>(part.basis.columns.size());
    linear.weights(part.output, part.basis.columns) +=
        part.readout.segment(units, columns).transpose();
    linear.constants[part.output] += part.readout[units + columns];
  }
  return linear;
}

Index units_of(std::span<const Part> parts) {
  Index units = 0;
  for (const Part& part : parts) units += part.basis.weights.rows();
  return units;
}

/// Standard deviation of a linear function over the rows, 1 if it is constant.
double spread_of(const Eigen::MatrixXd& scaled, const Eigen::VectorXd& weights) {
  const Eigen::VectorXd values = scaled * weights;
  const double variance = (values.array() - values.mean()).square().mean();
  return variance > 0.0 ? std::sqrt(variance) : 1.0;
}

model::DenseLayer layer(const Eigen::MatrixXd& weights, const Eigen::VectorXd& biases,
                        model::Activation activation) {
  model::DenseLayer result;
  result.weights = weights.cast<float>();
  result.biases = biases.cast<float>();
  result.activation = activation;
  return result;
}

}  // namespace

std::vector<model::DenseLayer> layers_of(std::span<const Part> parts, const Eigen::MatrixXd& scaled,
                                         const model::Standardiser& output) {
  const Index outputs = output.mean.size();
  const Index units = units_of(parts);
  const LinearParts linear = linear_parts(parts, outputs, scaled.cols());
  const Eigen::VectorXd inverse = output.scale.cwiseInverse();
  const Eigen::VectorXd biases = (linear.constants - output.mean).cwiseProduct(inverse);
  if (units == 0)
    return {layer(inverse.asDiagonal() * linear.weights, biases, model::Activation::kLinear)};
  Eigen::MatrixXd hidden = Eigen::MatrixXd::Zero(units + outputs, scaled.cols());
  Eigen::VectorXd hidden_biases = Eigen::VectorXd::Zero(units + outputs);
  Eigen::MatrixXd readout = Eigen::MatrixXd::Zero(outputs, units + outputs);
  Index at = 0;
  for (const Part& part : parts) {
    const Index count = part.basis.weights.rows();
    hidden.middleRows(at, count)(Eigen::all, part.basis.columns) = part.basis.weights;
    hidden_biases.segment(at, count) = part.basis.biases;
    readout.row(part.output).segment(at, count) =
        part.readout.head(count).transpose() * inverse[part.output];
    at += count;
  }
  for (Index k = 0; k < outputs; ++k) {
    const double step = kStraight / spread_of(scaled, linear.weights.row(k).transpose());
    hidden.row(units + k) = step * linear.weights.row(k);
    readout(k, units + k) = inverse[k] / step;
  }
  return {layer(hidden, hidden_biases, model::Activation::kTanh),
          layer(readout, biases, model::Activation::kLinear)};
}

}  // namespace ravencal::choice
