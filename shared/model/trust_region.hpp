// SPDX-License-Identifier: Apache-2.0
//
// How far a row of inputs is from the training set, all inputs together: every input may lie within
// its own range and the row still be one that no training row resembles (joint and motor positions
// that contradict each other). Probabilistic principal components (Tipping and Bishop, J. R. Stat.
// Soc. B 61, 1999): the training rows vary by themselves along a few directions, and by one common
// residual variance along all others. Not real time; the plugin evaluates the blob's copy.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

namespace ravencal::model {

/// In scaled inputs x (mean 0, standard deviation 1 over the training rows). With v_k a direction,
///   d2 = [sum_k (v_k x)^2 / variance_k + (|x|^2 - sum_k (v_k x)^2) / residual] / number of inputs,
/// about 1 on average over the training rows. The confidence is 1 up to d2 = full_distance, 0 from
/// none_distance on, and linear in d2 between. Single precision, as it is stored and evaluated.
struct TrustRegion {
  Eigen::MatrixXf directions;              ///< v_k, [rank x inputs], orthonormal rows; rank 1 to 16
  Eigen::VectorXf inverse_variance;        ///< [rank], rising
  float inverse_residual_variance = 1.0F;  ///< not below those of the directions
  float full_distance = 0.0F;              ///< > 0
  float none_distance = 0.0F;              ///< > full_distance

  /// d2 of each column of `scaled_inputs` [inputs x rows].
  [[nodiscard]] Eigen::VectorXf distances(const Eigen::MatrixXf& scaled_inputs) const;
  /// 0 to 1; 0 for a distance that is not a number.
  [[nodiscard]] float confidence(float distance) const noexcept;
};

/// The region of some of the inputs, `kept` (ascending, at least one): the marginal distribution of
/// theirs, which is of the same form. The distances are kept.
TrustRegion marginal(const TrustRegion& region, std::span<const std::size_t> kept);

}  // namespace ravencal::model
