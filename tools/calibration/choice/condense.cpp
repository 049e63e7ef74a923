// SPDX-License-Identifier: Apache-2.0
#include "choice/condense.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "model/unit_ranking.hpp"

namespace ravencal::choice {
namespace {

using Eigen::Index;

/// Points of each kind at which the mean is matched, for each unit.
constexpr Index kPointsPerUnit = 10;
/// Of the mean square of a function: keeps the readout of units that repeat each other small.
constexpr double kRidge = 1e-6;
/// From the middle of its trained range to where the plugin clamps an input, over half the range.
constexpr double kReach = 2.0;

/// Rows thinned evenly, then the same stretched to the limits of the inputs.
Eigen::MatrixXd matched_points(const Eigen::MatrixXd& scaled, Index most) {
  const Index stride = std::max<Index>(1, scaled.rows() / most);
  const Index count = (scaled.rows() + stride - 1) / stride;
  const Eigen::RowVectorXd middle =
      0.5 * (scaled.colwise().minCoeff() + scaled.colwise().maxCoeff());
  Eigen::MatrixXd points(2 * count, scaled.cols());
  for (Index i = 0; i < count; ++i) {
    points.row(i) = scaled.row(i * stride);
    points.row(count + i) = middle + kReach * (points.row(i) - middle);
  }
  return points;
}

Basis all_units(std::span<const Fit> fits) {
  Basis pool = fits.front().basis;
  const Index of_one = pool.weights.rows();
  const auto count = static_cast<Index>(fits.size());
  pool.weights.conservativeResize(count * of_one, Eigen::NoChange);
  pool.biases.conservativeResize(count * of_one);
  for (Index k = 1; k < count; ++k) {
    const Basis& basis = fits[static_cast<std::size_t>(k)].basis;
    pool.weights.middleRows(k * of_one, of_one) = basis.weights;
    pool.biases.segment(k * of_one, of_one) = basis.biases;
  }
  return pool;
}

Eigen::VectorXd mean_readout(std::span<const Fit> fits, const Basis& pool) {
  const auto count = static_cast<Index>(fits.size());
  const Index of_one = pool.weights.rows() / count;
  const Index rest = pool.size() - pool.weights.rows();
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(pool.size());
  for (Index k = 0; k < count; ++k) {
    const Eigen::VectorXd& readout = fits[static_cast<std::size_t>(k)].readout;
    mean.segment(k * of_one, of_one) = readout.head(of_one) / static_cast<double>(count);
    mean.tail(rest) += readout.tail(rest) / static_cast<double>(count);
  }
  return mean;
}

Eigen::VectorXd solve(const Eigen::MatrixXd& gram, const Eigen::VectorXd& cross) {
  Eigen::MatrixXd system = gram;
  system.diagonal() *= 1.0 + kRidge;
  return system.ldlt().solve(cross);
}

}  // namespace

Fit condensed(std::span<const Fit> fits, Index units, const Eigen::MatrixXd& scaled) {
  const Basis pool = all_units(fits);
  const Eigen::VectorXd mean = mean_readout(fits, pool);
  if (fits.size() == 1 || units >= pool.weights.rows()) return {pool, mean};
  const Eigen::MatrixXd points = matched_points(scaled, kPointsPerUnit * units);
  const Eigen::MatrixXd design = pool.design(points);
  const Eigen::VectorXd target = design * mean;
  const Index drawn = pool.weights.rows();
  const Index rest = pool.size() - drawn;
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(pool.size(), pool.size());
  gram.selfadjointView<Eigen::Lower>().rankUpdate(design.transpose());
  gram = gram.selfadjointView<Eigen::Lower>();
  const Eigen::VectorXd cross = design.transpose() * target;
  // What inputs and constant explain is theirs; units are chosen for the rest.
  Eigen::MatrixXd straight = gram.bottomRightCorner(rest, rest);
  straight.diagonal() *= 1.0 + kRidge;
  const Eigen::LDLT<Eigen::MatrixXd> of_straight(straight);
  const Eigen::MatrixXd share = of_straight.solve(gram.bottomLeftCorner(rest, drawn));
  const Eigen::MatrixXd covariance =
      gram.topLeftCorner(drawn, drawn) - gram.topRightCorner(drawn, rest) * share;
  const Eigen::VectorXd left = cross.head(drawn) - share.transpose() * cross.tail(rest);
  const auto order = model::rank_units(covariance, left, target.squaredNorm()).order;
  std::vector<Index> kept(order.begin(),
                          order.begin() + std::min<std::ptrdiff_t>(units, std::ssize(order)));
  Fit fit;
  fit.basis = {pool.columns, pool.weights(kept, Eigen::all), pool.biases(kept)};
  for (Index i = 0; i < rest; ++i) kept.push_back(drawn + i);
  fit.readout = solve(gram(kept, kept), cross(kept));
  return fit;
}

}  // namespace ravencal::choice
