// SPDX-License-Identifier: Apache-2.0
#include "learn/linear.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace ravencal::learn {

model::DenseLayer fit_linear(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& targets,
                             const Eigen::VectorXd& ridge) {
  const Eigen::Index rows = inputs.rows();
  const Eigen::Index features = inputs.cols();
  const Eigen::Index augmented = features + (ridge.maxCoeff() > 0.0 ? features : 0);
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(rows + augmented - features, features + 1);
  Eigen::MatrixXd b = Eigen::MatrixXd::Zero(a.rows(), targets.cols());
  a.topLeftCorner(rows, features) = inputs;
  a.topRightCorner(rows, 1).setOnes();
  b.topRows(rows) = targets;
  if (augmented > features) {
    a.bottomLeftCorner(features, features).diagonal() =
        (ridge * static_cast<double>(rows)).cwiseSqrt();
  }
  // Blocked QR of the tall matrix, then a rank-revealing one of the small triangle that is left.
  const Eigen::HouseholderQR<Eigen::Ref<Eigen::MatrixXd>> tall(a);
  b.applyOnTheLeft(tall.householderQ().adjoint());
  const Eigen::Index rank_rows = std::min(a.rows(), a.cols());
  const Eigen::MatrixXd triangle =
      tall.matrixQR().topRows(rank_rows).template triangularView<Eigen::Upper>();
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
  solver.setThreshold(1e-6);  // single precision resolves 6e-8 of a value; some digits of margin
  solver.compute(triangle);
  const Eigen::MatrixXd solution = solver.solve(b.topRows(rank_rows));

  model::DenseLayer layer;
  layer.weights = solution.topRows(features).transpose().cast<float>();
  layer.biases = solution.bottomRows(1).transpose().cast<float>();
  layer.activation = model::Activation::kLinear;
  return layer;
}

model::DenseLayer fit_linear(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& targets,
                             double ridge) {
  return fit_linear(inputs, targets, Eigen::VectorXd::Constant(inputs.cols(), ridge));
}

}  // namespace ravencal::learn
