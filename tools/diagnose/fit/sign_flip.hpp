// SPDX-License-Identifier: Apache-2.0
//
// Evidence against chance over all candidates at once: signs of whole blocks are flipped, the
// least likely gain of any candidate is noted each time, and a candidate's p-value is how often
// chance did as well (max-T after Westfall and Young, residuals of the full model after ter Braak
// 1992). Circular shifts would make constants and steps untestable; a null from a residual that
// still holds an effect would hide the others.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace ravencal::diagnose {

/// One way in which a candidate could explain the residual: its columns without what the model
/// already explains.
struct FlipOption {
  Eigen::MatrixXd scores;   ///< [blocks x m]: columns' product with the noise residual, per block
  Eigen::MatrixXd inverse;  ///< [m x m]: inverse of the columns' moments
};

struct FlipCandidate {
  std::vector<FlipOption> options;  ///< the whole search over shapes takes part in the null
  double gain = 0.0;                ///< reduction of the squared error that was found
  std::size_t found_option = 0;     ///< the option nearest to what was found
};

struct FlipResult {
  std::vector<double> p_value;      ///< per candidate, corrected for the search over all of them
  std::vector<double> median_null;  ///< gain that chance reaches half of the time
  /// Gain that is as unlikely as what the luckiest candidate reaches by chance with `alpha`.
  std::vector<double> critical_gain;
};

FlipResult sign_flip_test(const std::vector<FlipCandidate>& candidates, double alpha,
                          std::uint64_t seed, int flips = 1999);

/// Two-sided p-value of the mean of block values against zero, by flipping their signs.
double sign_flip_p(const Eigen::VectorXd& block_values, std::uint64_t seed, int flips = 1999);

/// Values whose patterns of signs are few enough to go through all of them.
inline constexpr Eigen::Index kMostExactFlips = 32;

/// The same p-value over every pattern of signs (Fisher 1935): no draw, and as little as
/// `least_exact_p`, where drawn flips never fall below 1 / flips. More than `kMostExactFlips`
/// values are put together first, neighbour to neighbour.
double exact_sign_flip_p(const Eigen::VectorXd& block_values);

/// That p-value of so many values that all have one sign.
double least_exact_p(Eigen::Index values);

}  // namespace ravencal::diagnose
