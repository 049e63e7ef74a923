// SPDX-License-Identifier: Apache-2.0
#include "study/compare_evaluate.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>

#include "core/random.hpp"
#include "core/units.hpp"

namespace ravencal::study {
namespace {

using methods::Series;

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint64_t kLeastCellRows = 5;

/// Largest magnitude in each block of kBlockS, of all series.
std::vector<double> block_peaks(std::span<const Series> series,
                                const std::vector<Eigen::MatrixXd>& left, Eigen::Index output) {
  std::vector<double> peaks;
  for (std::size_t s = 0; s < series.size(); ++s) {
    Eigen::Index last = -1;
    for (Eigen::Index row = 0; row < left[s].rows(); ++row) {
      const double error = std::abs(left[s](row, output));
      if (!std::isfinite(error)) continue;
      const auto block = static_cast<Eigen::Index>(series[s].t_s[row] / kBlockS);
      if (block != last) peaks.push_back(0.0);
      last = block;
      peaks.back() = std::max(peaks.back(), error);
    }
  }
  return peaks;
}

Interval peak_interval(const std::vector<double>& peaks, std::uint64_t seed) {
  core::Random random(seed);
  std::vector<double> drawn;
  for (std::size_t i = 0; i < kResamples && !peaks.empty(); ++i) {
    double peak = 0.0;
    for (std::size_t k = 0; k < peaks.size(); ++k)
      peak = std::max(peak, peaks[random.below(peaks.size())]);
    drawn.push_back(peak);
  }
  return central_interval(std::move(drawn));
}

/// Processor time of this thread, so that other work on the machine does not count.
double processor_time_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

std::vector<double> resampled_rmse(const std::vector<ErrorBlocks>& blocks,
                                   const Resamples& resamples) {
  return resamples.rmse({blocks});
}

}  // namespace

std::vector<Eigen::MatrixXd> errors_left(methods::Predictor& predictor,
                                         std::span<const Series> series) {
  std::vector<Eigen::MatrixXd> left;
  for (const Series& s : series) left.push_back(s.errors - predictor.predict(s));
  return left;
}

FigureAndBlocks figure_of(std::span<const Series> series, const std::vector<Eigen::MatrixXd>& left,
                          Eigen::Index output, double per_si, std::uint64_t seed) {
  FigureAndBlocks result;
  CompareFigure& f = result.figure;
  f.peak = 0.0;
  f.effective_samples = 0.0;
  for (std::size_t s = 0; s < series.size(); ++s) {
    std::vector<double> t(series[s].t_s.data(), series[s].t_s.data() + series[s].rows());
    std::vector<double> e(t.size());
    for (std::size_t i = 0; i < e.size(); ++i)
      e[i] = per_si * left[s](static_cast<Eigen::Index>(i), output);
    result.blocks.push_back(blocks_of(t, e));
    f.peak = std::max(f.peak, result.blocks.back().peak);
    f.samples += result.blocks.back().samples();
    if (std::isfinite(result.blocks.back().effective_samples))
      f.effective_samples += result.blocks.back().effective_samples;
  }
  f.rmse = pooled_rmse(result.blocks);
  if (f.samples == 0.0) return result;
  const std::vector<SeedErrors> joints = {{result.blocks}};
  const Interval rmse =
      central_interval(resampled_rmse(result.blocks, resamples_for(joints, seed)));
  f.rmse_low = rmse.low;
  f.rmse_high = rmse.high;
  const Interval peak = peak_interval(block_peaks(series, left, output), seed);
  f.peak_low = per_si * peak.low;
  f.peak_high = per_si * peak.high;
  return result;
}

Ratio paired_ratio(const std::vector<ErrorBlocks>& a, const std::vector<ErrorBlocks>& b,
                   std::uint64_t seed) {
  // Runs as long as the longer memory of the two.
  const std::vector<SeedErrors> both = {{a}, {b}};
  const Resamples resamples = resamples_for(both, seed);
  const std::vector<double> x = resampled_rmse(a, resamples);
  const std::vector<double> y = resampled_rmse(b, resamples);
  std::vector<double> ratios(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) ratios[i] = x[i] / y[i];
  const Interval interval = central_interval(std::move(ratios));
  return {pooled_rmse(a) / pooled_rmse(b), interval.low, interval.high};
}

std::optional<MapAxes> map_axes_of(std::span<const Series> series, std::size_t cells) {
  MapAxes axes;
  for (const Series& s : series) {
    for (Eigen::Index row = 0; row < s.rows(); ++row) {
      const bool known = s.errors.row(row).array().isFinite().any();
      axes.x.push_back(known ? s.estimate(row, 0) : kNothing);
      axes.y.push_back(known ? s.estimate(row, 1) : kNothing);
    }
  }
  const std::optional<report::MapGrid> grid = report::grid_over(axes.x, axes.y, cells);
  if (!grid) return std::nullopt;
  axes.grid = *grid;
  return axes;
}

CompareGrid grid_of(const MapAxes& axes, std::span<const model::OutputSpec> outputs) {
  const report::MapGrid& grid = axes.grid;
  const auto x = core::display_unit(outputs[0].unit), y = core::display_unit(outputs[1].unit);
  return {{outputs[0].joint, x.name,
           report::edges_of(grid.x_from * x.per_si, grid.x_to * x.per_si, grid.columns)},
          {outputs[1].joint, y.name,
           report::edges_of(grid.y_from * y.per_si, grid.y_to * y.per_si, grid.rows)}};
}

std::vector<double> error_map_of(const MapAxes& axes, const std::vector<Eigen::MatrixXd>& left,
                                 Eigen::Index output, double per_si) {
  std::vector<double> errors;
  for (const Eigen::MatrixXd& part : left)
    errors.insert(errors.end(), part.col(output).begin(), part.col(output).end());
  const std::vector<std::int8_t> any(errors.size(), 0);
  std::vector<double> rmse;
  for (const report::MapCell& cell : report::error_map(axes.grid, axes.x, axes.y, errors, any, 0))
    rmse.push_back(cell.samples < kLeastCellRows ? kNothing : per_si * cell.rmse);
  return rmse;
}

StepTime time_steps(methods::Predictor& predictor, const Series& series) {
  constexpr Eigen::Index kMostSteps = 5000;
  constexpr double kLongestUs = 2e6;
  std::vector<double> us;
  Eigen::VectorXd correction(series.errors.cols());
  bool fresh = true;
  double spent_us = 0.0;
  for (Eigen::Index row = 0; row < series.rows() && row < kMostSteps && spent_us < kLongestUs;
       ++row) {
    fresh = fresh || series.fresh[static_cast<std::size_t>(row)] != 0;
    if (!series.usable(row)) continue;
    if (fresh) predictor.start(series, row);
    fresh = false;
    const double before = processor_time_us();
    predictor.step(series, row, correction);
    us.push_back(processor_time_us() - before);
    spent_us += us.back();
  }
  if (us.empty()) return {};
  std::sort(us.begin(), us.end());
  const auto at = [&](double share) {
    return us[static_cast<std::size_t>(share * static_cast<double>(us.size() - 1))];
  };
  return {at(0.5), at(0.99), at(0.999)};
}

}  // namespace ravencal::study
