// SPDX-License-Identifier: Apache-2.0
#include "study/error_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace ravencal::study {
namespace {

/// Correlation is measured between means of short bins: lags of minutes at a hundredth of the cost.
constexpr double kBinS = 0.1;

double mean_of(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Population variance; 0 where only rounding is left of it.
double variance_of(std::span<const double> values) {
  const double mean = mean_of(values);
  double sum = 0.0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  const double variance = sum / static_cast<double>(values.size());
  constexpr double kRounding = 1e-24;  // of the mean's square: (1e-12)^2, thousands of sums
  return variance > kRounding * mean * mean ? variance : 0.0;
}

/// Means of the squared errors over bins of kBinS; bins without a sample are left out.
std::vector<double> bin_means(std::span<const double> t_s, std::span<const double> squares) {
  std::vector<double> means;
  double sum = 0.0;
  std::size_t count = 0;
  double end_s = kBinS;
  const auto close = [&] {
    if (count > 0) means.push_back(sum / static_cast<double>(count));
    sum = 0.0;
    count = 0;
  };
  for (std::size_t i = 0; i < squares.size(); ++i) {
    if (t_s[i] >= end_s) {
      close();
      end_s = (std::floor(t_s[i] / kBinS) + 1.0) * kBinS;
    }
    sum += squares[i];
    ++count;
  }
  close();
  return means;
}

/// Fills the figures about correlation from the finite samples.
void measure_correlation(std::span<const double> t_s, std::span<const double> squares,
                         ErrorBlocks& blocks) {
  const std::vector<double> means = bin_means(t_s, squares);
  const double variance = variance_of(squares);
  const double bin_variance = variance_of(means);
  if (!(bin_variance > 0.0) || means.size() < 2) {
    blocks.effective_samples = static_cast<double>(squares.size());
    return;
  }
  const double bins = autocorrelation_time(means);
  const double variance_of_mean = bin_variance * bins / static_cast<double>(means.size());
  blocks.effective_samples =
      std::clamp(variance / variance_of_mean, 1.0, static_cast<double>(squares.size()));
  blocks.correlation_s = bins * kBinS;
}

}  // namespace

double ErrorBlocks::samples() const {
  return static_cast<double>(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}));
}

double ErrorBlocks::rmse() const {
  return std::sqrt(std::accumulate(squares.begin(), squares.end(), 0.0) / samples());
}

double autocorrelation_time(std::span<const double> values) {
  const std::size_t count = values.size();
  if (count < 2) return 1.0;
  const double mean = mean_of(values);
  const double variance = variance_of(values);
  if (!(variance > 0.0)) return 1.0;
  double tau = 1.0;
  for (std::size_t lag = 1; lag < count; ++lag) {
    double product = 0.0;
    for (std::size_t i = 0; i + lag < count; ++i) {
      product += (values[i] - mean) * (values[i + lag] - mean);
    }
    tau += 2.0 * product / (variance * static_cast<double>(count));
    if (static_cast<double>(lag) >= 5.0 * tau) break;
  }
  return std::max(1.0, tau);
}

ErrorBlocks blocks_of(std::span<const double> t_s, std::span<const double> errors) {
  ErrorBlocks blocks;
  std::vector<double> times;
  std::vector<double> squares;
  double number = -1.0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (const double own = std::floor(t_s[i] / kBlockS); own != number) {
      number = own;
      blocks.squares.push_back(0.0);
      blocks.counts.push_back(0);
    }
    if (!std::isfinite(errors[i])) continue;
    const double square = errors[i] * errors[i];
    blocks.squares.back() += square;
    ++blocks.counts.back();
    blocks.peak = std::max(blocks.peak, std::abs(errors[i]));
    times.push_back(t_s[i]);
    squares.push_back(square);
  }
  if (!squares.empty()) measure_correlation(times, squares, blocks);
  return blocks;
}

}  // namespace ravencal::study
