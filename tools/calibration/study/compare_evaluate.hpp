// SPDX-License-Identifier: Apache-2.0
//
// Evaluates a fitted predictor: errors with intervals, error maps, the time of one step.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "methods/method.hpp"
#include "study/bootstrap.hpp"
#include "study/compare_result.hpp"

namespace ravencal::study {

/// Errors that are left over a set of series: per series [rows x outputs], truth - corrected, SI.
std::vector<Eigen::MatrixXd> errors_left(methods::Predictor& predictor,
                                         std::span<const methods::Series> series);

/// Figure and blocks of one output, in units of `per_si`. The same `seed` draws the same blocks for
/// every method.
struct FigureAndBlocks {
  CompareFigure figure;
  std::vector<ErrorBlocks> blocks;
};
FigureAndBlocks figure_of(std::span<const methods::Series> series,
                          const std::vector<Eigen::MatrixXd>& left, Eigen::Index output,
                          double per_si, std::uint64_t seed);

/// Ratio of two RMSE over the same rows, with its interval from paired resamples.
struct Ratio {
  double value = 1.0, low = 1.0, high = 1.0;
};
Ratio paired_ratio(const std::vector<ErrorBlocks>& a, const std::vector<ErrorBlocks>& b,
                   std::uint64_t seed);

/// RMSE over cells x cells of the estimates of outputs `x` and `y`.
std::vector<double> error_map_of(std::span<const methods::Series> series,
                                 const std::vector<Eigen::MatrixXd>& left, Eigen::Index output,
                                 double per_si, Eigen::Index x, Eigen::Index y, std::size_t cells);

/// Processor time of single steps over `series`, two seconds in all at most.
StepTime time_steps(methods::Predictor& predictor, const methods::Series& series);

}  // namespace ravencal::study
