// SPDX-License-Identifier: Apache-2.0
#include "model/trust_region.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <vector>

namespace ravencal::model {

Eigen::VectorXf TrustRegion::distances(const Eigen::MatrixXf& scaled_inputs) const {
  const Eigen::MatrixXf along = (directions * scaled_inputs).cwiseAbs2();
  const Eigen::VectorXf held = (along.transpose() * inverse_variance);
  const Eigen::VectorXf rest =
      (scaled_inputs.colwise().squaredNorm() - along.colwise().sum()).cwiseMax(0.0F).transpose();
  return (held + rest * inverse_residual_variance) / static_cast<float>(directions.cols());
}

float TrustRegion::confidence(float distance) const noexcept {
  if (!(distance < none_distance)) return 0.0F;
  if (distance <= full_distance) return 1.0F;
  return (none_distance - distance) / (none_distance - full_distance);
}

TrustRegion marginal(const TrustRegion& region, std::span<const std::size_t> kept) {
  // The marginal covariance is B B' + residual I with B = directions, restricted and stretched to
  // what they have beyond the residual; its eigenvectors are the left singular vectors of B.
  const double residual = 1.0 / static_cast<double>(region.inverse_residual_variance);
  const Eigen::VectorXd beyond =
      (region.inverse_variance.cast<double>().cwiseInverse().array() - residual).max(0.0).sqrt();
  const std::vector<Eigen::Index> columns(kept.begin(), kept.end());
  const Eigen::MatrixXd directions = region.directions(Eigen::all, columns).cast<double>();
  const Eigen::MatrixXd stretched = beyond.asDiagonal() * directions;  // B', [rank x kept]
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(stretched, Eigen::ComputeThinV);
  const Eigen::VectorXd variance = svd.singularValues().cwiseAbs2().array() + residual;

  TrustRegion result = region;
  result.directions = svd.matrixV().transpose().cast<float>();
  result.inverse_variance =
      variance.cwiseInverse().cast<float>().cwiseMin(region.inverse_residual_variance);
  return result;
}

}  // namespace ravencal::model
