// SPDX-License-Identifier: Apache-2.0
#include "learn/linear.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace ravencal::learn {

model::DenseLayer fit_linear(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& targets,
                             double ridge) {
  const Eigen::Index rows = inputs.rows();
  const Eigen::Index features = inputs.cols();
  const Eigen::Index augmented = features + (ridge > 0.0 ? features : 0);
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(rows + augmented - features, features + 1);
  Eigen::MatrixXd b = Eigen::MatrixXd::Zero(a.rows(), targets.cols());
  a.topLeftCorner(rows, features) = inputs;
  a.topRightCorner(rows, 1).setOnes();
  b.topRows(rows) = targets;
  if (ridge > 0.0) {
    a.bottomLeftCorner(features, features)
        .diagonal()
        .setConstant(std::sqrt(ridge * static_cast<double>(rows)));
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

}  // namespace ravencal::learn
