// SPDX-License-Identifier: Apache-2.0
#include "model/unit_ranking.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

namespace ravencal::model {
namespace {

/// Of an input's own variance: what is left after others have explained it is rounding below this.
constexpr double kResolution = 1e-9;
/// Of the mean variance of the inputs. The targets are matched to about its root, 0.3 %, where the
/// inputs repeat each other, and the weights stay of the size that they had.
constexpr double kRidge = 1e-5;

}  // namespace

std::vector<Eigen::Index> UnitRanking::first_within(double mean_square) const {
  std::size_t count = 1;
  while (count < order.size() && residual[count] > mean_square) ++count;
  return {order.begin(),
          order.begin() + static_cast<std::ptrdiff_t>(std::min(count, order.size()))};
}

UnitRanking rank_units(Eigen::MatrixXd covariance, Eigen::MatrixXd cross, double target_square) {
  const Eigen::VectorXd variance = covariance.diagonal();
  UnitRanking ranking;
  ranking.residual.push_back(target_square);
  for (Eigen::Index taken = 0; taken < covariance.rows(); ++taken) {
    const Eigen::ArrayXd left = covariance.diagonal().array();
    const Eigen::ArrayXd explained =
        (left > kResolution * variance.array())
            .select(cross.rowwise().squaredNorm().array() / left.max(1e-300), 0.0);
    Eigen::Index best = 0;
    const double gain = explained.maxCoeff(&best);
    if (!(gain > 0.0)) break;
    ranking.order.push_back(best);
    ranking.residual.push_back(std::max(0.0, ranking.residual.back() - gain));
    const Eigen::VectorXd share = covariance.col(best) / covariance(best, best);
    const Eigen::RowVectorXd explains = cross.row(best);
    cross.noalias() -= share * explains;
    const Eigen::RowVectorXd row = covariance.row(best);
    covariance.noalias() -= share * row;
    covariance(best, best) = 0.0;
  }
  if (ranking.order.empty()) {
    ranking.order.push_back(0);
    ranking.residual.push_back(target_square);
  }
  return ranking;
}

LinearFit fit_linear_map(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& targets) {
  const Eigen::VectorXd input_mean = inputs.rowwise().mean();
  const Eigen::VectorXd target_mean = targets.rowwise().mean();
  const Eigen::MatrixXd centred = inputs.colwise() - input_mean;
  Eigen::MatrixXd normal = centred * centred.transpose();
  const double ridge = kRidge * normal.trace() / static_cast<double>(normal.rows());
  normal.diagonal().array() += std::max(ridge, 1e-12);
  LinearFit fit;
  fit.weights =
      normal.ldlt().solve(centred * (targets.colwise() - target_mean).transpose()).transpose();
  fit.biases = target_mean - fit.weights * input_mean;
  return fit;
}

}  // namespace ravencal::model
