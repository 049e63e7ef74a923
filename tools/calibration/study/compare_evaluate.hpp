// SPDX-License-Identifier: Apache-2.0
//
// Evaluates a fitted predictor: errors with intervals, error maps, the time of one step.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "methods/method.hpp"
#include "report/reduce.hpp"
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

/// Where the rows of some series lie, end to end, and the cells over them: estimates of the first
/// two outputs, SI units, NaN in rows whose errors are not known.
struct MapAxes {
  std::vector<double> x, y;
  report::MapGrid grid;
};
/// None if the rows have no extent along both.
std::optional<MapAxes> map_axes_of(std::span<const methods::Series> series, std::size_t cells);

/// The cells in display units.
CompareGrid grid_of(const MapAxes& axes, std::span<const model::OutputSpec> outputs);

/// RMSE of one output by cell, in units of `per_si`; NaN where there are too few rows. `left` is of
/// the series of `axes`.
std::vector<double> error_map_of(const MapAxes& axes, const std::vector<Eigen::MatrixXd>& left,
                                 Eigen::Index output, double per_si);

/// Processor time of single steps over `series`, two seconds in all at most.
StepTime time_steps(methods::Predictor& predictor, const methods::Series& series);

}  // namespace ravencal::study
