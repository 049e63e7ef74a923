// SPDX-License-Identifier: Apache-2.0
//
// Which few of a layer's inputs reproduce nearly all of the layer's sums. Not real time.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace ravencal::model {

/// Inputs of a layer in the order of their use.
struct UnitRanking {
  std::vector<Eigen::Index> order;
  /// residual[k]: mean square of what the best linear use of the first k leaves of the targets;
  /// one longer than `order`, falling.
  std::vector<double> residual;

  /// Fewest, at least one, that leave no more than `mean_square`.
  [[nodiscard]] std::vector<Eigen::Index> first_within(double mean_square) const;
};

/// Orthogonal matching pursuit with many targets: takes the input that explains most of what is
/// left, removes its part from all others, and so on. `covariance` [inputs x inputs], `cross`
/// [inputs x targets] and `target_square`, the mean square of all targets together, are of centred
/// values. Ends where what is left of every input is rounding.
UnitRanking rank_units(Eigen::MatrixXd covariance, Eigen::MatrixXd cross, double target_square);

/// weights and bias of targets = weights * inputs + bias in the least squares sense; both are
/// [values x rows]. Ridge: weights of inputs that repeat each other stay small, so that they can be
/// rounded.
struct LinearFit {
  Eigen::MatrixXd weights;
  Eigen::VectorXd biases;
};
LinearFit fit_linear_map(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& targets);

}  // namespace ravencal::model
