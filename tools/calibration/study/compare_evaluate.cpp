// SPDX-License-Identifier: Apache-2.0
#include "study/compare_evaluate.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>

#include "core/random.hpp"

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

std::vector<double> error_map_of(std::span<const Series> series,
                                 const std::vector<Eigen::MatrixXd>& left, Eigen::Index output,
                                 double per_si, Eigen::Index x, Eigen::Index y, std::size_t cells) {
  Eigen::Array2d low = Eigen::Array2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Array2d high = -low;
  const auto place = [&](const Series& s, Eigen::Index row) {
    return Eigen::Array2d(s.estimate(row, x), s.estimate(row, y));
  };
  const auto each = [&](const auto& use) {
    for (std::size_t s = 0; s < series.size(); ++s) {
      for (Eigen::Index row = 0; row < left[s].rows(); ++row) {
        const Eigen::Array2d at = place(series[s], row);
        if (at.isFinite().all() && std::isfinite(left[s](row, output)))
          use(at, left[s](row, output));
      }
    }
  };
  each([&](const Eigen::Array2d& at, double) {
    low = low.min(at);
    high = high.max(at);
  });
  std::vector<double> squares(cells * cells, 0.0);
  std::vector<std::uint64_t> counts(cells * cells, 0);
  const Eigen::Array2d span = (high - low).max(1e-12);
  each([&](const Eigen::Array2d& at, double error) {
    const Eigen::Array2d cell =
        ((at - low) / span * static_cast<double>(cells)).min(static_cast<double>(cells) - 0.5);
    const auto index =
        static_cast<std::size_t>(cell[1]) * cells + static_cast<std::size_t>(cell[0]);
    squares[index] += error * error;
    ++counts[index];
  });
  std::vector<double> rmse(squares.size(), kNothing);
  for (std::size_t i = 0; i < rmse.size(); ++i) {
    if (counts[i] >= kLeastCellRows)
      rmse[i] = per_si * std::sqrt(squares[i] / static_cast<double>(counts[i]));
  }
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
