// SPDX-License-Identifier: Apache-2.0
#include "model/trust_fit.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <vector>

#include "model/blob_format.hpp"

namespace ravencal::model {
namespace {

constexpr Eigen::Index kMaxRank = blob::kMaxTrustRank;
/// Of the variance, held by the directions.
constexpr double kHeldShare = 0.99;
/// Of a scaled input, whose standard deviation is 1: an encoder count or two of a signal that moves
/// by a hundred, and far above what the difference |x|^2 - sum (v x)^2 loses in single precision.
constexpr double kLeastVariance = 1e-3;
/// In scaled inputs; less is a constant, and rounding.
constexpr double kConstantVariance = 1e-6;
/// A zig-zag's cube has 1/sqrt(3) of the joint ranges as edges (input_limits.hpp), so that motion
/// over the whole ranges is sqrt(3) times as wide, and d2 three times as large, without telling of
/// a new kind of motion.
constexpr float kFullOverTraining = 3.0F;
constexpr float kNoneOverFull = 4.0F;
constexpr Eigen::Index kBlockRows = 1024;  ///< bounds the memory of a pass

/// Rows [first, first + count) as the network sees them, [inputs x count].
Eigen::MatrixXd scaled_block(const Standardiser& input, const FeatureMatrix& features_si,
                             Eigen::Index first, Eigen::Index count) {
  const Eigen::MatrixXd values = features_si.middleRows(first, count).transpose().cast<double>();
  return ((values.colwise() - input.mean).array().colwise() / input.scale.array()).matrix();
}

/// Principal components of a covariance, largest first, as many as a region may have.
TrustRegion components(const Eigen::MatrixXd& covariance, double held_share) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  const Eigen::VectorXd variance = solver.eigenvalues().reverse().cwiseMax(0.0);
  const double total = variance.sum();
  const auto varying = (covariance.diagonal().array() > kConstantVariance).count();
  const Eigen::Index most = std::clamp<Eigen::Index>(varying, 1, kMaxRank);
  Eigen::Index rank = 1;
  while (rank < most && variance.head(rank).sum() < held_share * total) ++rank;
  const auto others = static_cast<double>(std::max<Eigen::Index>(varying - rank, 1));
  const double residual = (total - variance.head(rank).sum()) / others;

  TrustRegion region;
  region.directions =
      solver.eigenvectors().rightCols(rank).rowwise().reverse().transpose().cast<float>();
  region.inverse_variance =
      variance.head(rank).cwiseMax(kLeastVariance).cwiseInverse().cast<float>();
  region.inverse_residual_variance =
      std::max(static_cast<float>(1.0 / std::max(residual, kLeastVariance)),
               region.inverse_variance(rank - 1));
  // The first input of weight is positive: eigenvectors have no sign, files should have one.
  for (Eigen::Index k = 0; k < rank; ++k) {
    Eigen::Index largest = 0;
    region.directions.row(k).cwiseAbs().maxCoeff(&largest);
    if (region.directions(k, largest) < 0.0F) region.directions.row(k) *= -1.0F;
  }
  return region;
}

}  // namespace

TrustRegion fit_trust_region(const Standardiser& input, const FeatureMatrix& features_si) {
  const Eigen::Index rows = features_si.rows();
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(features_si.cols(), features_si.cols());
  for (Eigen::Index first = 0; first < rows; first += kBlockRows) {
    const Eigen::MatrixXd block =
        scaled_block(input, features_si, first, std::min(kBlockRows, rows - first));
    sums.selfadjointView<Eigen::Lower>().rankUpdate(block);
  }
  const Eigen::MatrixXd covariance =
      Eigen::MatrixXd(sums.selfadjointView<Eigen::Lower>()) / static_cast<double>(rows);
  TrustRegion region = components(covariance, kHeldShare);
  fit_distances(region, input, features_si);
  return region;
}

void fit_distances(TrustRegion& region, const Standardiser& input,
                   const FeatureMatrix& features_si) {
  const Eigen::Index rows = features_si.rows();
  std::vector<float> distances;
  distances.reserve(static_cast<std::size_t>(rows));
  for (Eigen::Index first = 0; first < rows; first += kBlockRows) {
    const Eigen::VectorXf block = region.distances(
        scaled_block(input, features_si, first, std::min(kBlockRows, rows - first)).cast<float>());
    distances.insert(distances.end(), block.begin(), block.end());
  }
  const auto beyond = static_cast<std::ptrdiff_t>(kDoubtedShare * static_cast<double>(rows));
  const auto full = distances.end() - 1 - beyond;
  std::nth_element(distances.begin(), full, distances.end());
  // Rows that are all alike have distance 0; a region of no extent would trust nothing.
  region.full_distance = kFullOverTraining * std::max(*full, 1e-3F);
  region.none_distance = kNoneOverFull * region.full_distance;
}

}  // namespace ravencal::model
