// SPDX-License-Identifier: Apache-2.0
#include "learn/simulated.hpp"

#include "core/require.hpp"

namespace ravencal::learn {
namespace {

using Eigen::Index;

/// Both layers as one. The first shares its input, the last its output, those between share
/// nothing.
model::DenseLayer side_by_side(const model::DenseLayer& a, const model::DenseLayer& b, bool first,
                               bool last) {
  const Index rows = a.weights.rows() + (last ? 0 : b.weights.rows());
  const Index columns = a.weights.cols() + (first ? 0 : b.weights.cols());
  model::DenseLayer both;
  both.activation = a.activation;
  both.weights.setZero(rows, columns);
  both.biases.setZero(rows);
  both.weights.topLeftCorner(a.weights.rows(), a.weights.cols()) = a.weights;
  both.biases.head(a.biases.size()) = a.biases;
  both.weights.bottomRightCorner(b.weights.rows(), b.weights.cols()) += b.weights;
  both.biases.tail(b.biases.size()) += b.biases;
  return both;
}

}  // namespace

Dataset joined(const Dataset& first, const Dataset& second) {
  Dataset all = first;
  const Index rows = first.features.rows() + second.features.rows();
  all.features.resize(rows, first.features.cols());
  all.features << first.features, second.features;
  all.errors.resize(rows, first.errors.cols());
  all.errors << first.errors, second.errors;
  return all;
}

Dataset left_by(const model::CalibrationModel& base, const Dataset& data) {
  Dataset left = data;
  left.errors -= base.predict(data.features.cast<double>());
  return left;
}

std::vector<model::DenseLayer> in_units_of(const model::Standardiser& to,
                                           const model::Standardiser& from,
                                           std::vector<model::DenseLayer> layers) {
  const Eigen::VectorXf scale = from.scale.cwiseQuotient(to.scale).cast<float>();
  const Eigen::VectorXf shift = (from.mean - to.mean).cwiseQuotient(to.scale).cast<float>();
  model::DenseLayer& last = layers.back();
  last.weights = (scale.asDiagonal() * last.weights).eval();
  last.biases = scale.cwiseProduct(last.biases) + shift;
  return layers;
}

std::vector<model::DenseLayer> sum_of(const std::vector<model::DenseLayer>& first,
                                      const std::vector<model::DenseLayer>& second) {
  core::require(first.size() == second.size(), "a sum needs two networks of as many layers");
  std::vector<model::DenseLayer> sum;
  for (std::size_t layer = 0; layer < first.size(); ++layer)
    sum.push_back(side_by_side(first[layer], second[layer], layer == 0, layer + 1 == first.size()));
  return sum;
}

}  // namespace ravencal::learn
