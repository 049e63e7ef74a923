// SPDX-License-Identifier: Apache-2.0
//
// Intervals of figures that come from correlated samples and a few seeds: blocks of time are drawn
// with replacement (circular block bootstrap, Politis and Romano 1992) and so are seeds, the same
// draws for every row of a table, so that differences between rows are paired. Deterministic.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "study/error_blocks.hpp"

namespace ravencal::study {

inline constexpr std::size_t kResamples = 1000;

/// Errors of one joint, per seed (outer) and test recording (inner). All seeds saw the same tests.
using SeedErrors = std::vector<std::vector<ErrorBlocks>>;

struct Interval {
  double low = 0.0;
  double high = 0.0;
};

/// Central 95 % of the finite values; NaN if there are fewer than 40.
Interval central_interval(std::vector<double> values);

/// How often each seed and each block counts, for each of kResamples resamples.
class Resamples {
 public:
  /// `blocks_per_recording`, `seeds` and `run_blocks` (neighbouring blocks drawn together) >= 1.
  Resamples(std::span<const std::size_t> blocks_per_recording, std::size_t seeds,
            std::size_t run_blocks, std::uint64_t seed);

  /// Mean over seeds of the RMSE over all recordings, for each resample. `errors` must have the
  /// shape that this was made for.
  [[nodiscard]] std::vector<double> rmse(const SeedErrors& errors) const;

 private:
  std::size_t seeds_ = 0;
  std::vector<std::size_t> first_block_;  ///< of each recording in a row of weights
  std::vector<std::vector<std::uint16_t>> block_weights_;
  std::vector<std::vector<std::uint16_t>> seed_weights_;
};

/// Resamples for these errors, with runs four correlation times long (of the longest, but a quarter
/// of the shortest recording at most).
Resamples resamples_for(std::span<const SeedErrors> joints, std::uint64_t seed);

/// RMSE over all recordings of one seed.
double pooled_rmse(std::span<const ErrorBlocks> recordings);

}  // namespace ravencal::study
