// SPDX-License-Identifier: Apache-2.0
//
// What is kept of a test's errors: sums of squares over blocks of equal duration, from which RMSE
// and its interval follow, the peak, and how many independent samples the correlated ones are
// worth. SI units. Pure functions, any thread.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace ravencal::study {

/// Duration of a block: several times a control cycle's memory, and short enough that five minutes
/// make sixty of them.
inline constexpr double kBlockS = 5.0;

/// Errors of one joint in one test recording. `squares` and `counts` have the same length. A block
/// without a usable sample is there with count 0, so that block i is the same time in every row; a
/// time without any rows (a clock that jumps) has no blocks.
struct ErrorBlocks {
  std::vector<double> squares;
  std::vector<std::uint32_t> counts;
  double peak = 0.0;               ///< largest magnitude
  double effective_samples = 0.0;  ///< variance(e^2) / variance of its mean
  double correlation_s = 0.0;      ///< integrated autocorrelation time of e^2

  [[nodiscard]] double samples() const;
  [[nodiscard]] double rmse() const;  ///< NaN without samples
};

/// `errors` at times `t_s` since the recording's start (never falling); NaN is no sample.
ErrorBlocks blocks_of(std::span<const double> t_s, std::span<const double> errors);

/// Integrated autocorrelation time in samples, 1 + 2 sum(rho), at least 1; window by Sokal's rule
/// (the least W >= 5 tau(W); Madras and Sokal, J. Stat. Phys. 50, 1988).
double autocorrelation_time(std::span<const double> values);

}  // namespace ravencal::study
