// SPDX-License-Identifier: Apache-2.0
#include "diagnose/selection/step.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/median.hpp"
#include "diagnose/findings/policy.hpp"
#include "diagnose/findings/quantiles.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr std::size_t kMostSteps = 4;

/// First training row of the stretch without a new start that holds training row n.
std::vector<Index> stretch_starts(const Series& series, const Blocks& blocks) {
  std::vector<Index> starts(blocks.rows.size());
  for (const auto& [first, last] : stretches_of(series, blocks.rows))
    std::fill(starts.begin() + first, starts.begin() + last, first);
  return starts;
}

/// Mean after minus mean before each training row; 0 where a window would leave its stretch.
VectorXd step_statistic(const VectorXd& residual, const std::vector<Index>& starts, Index window) {
  VectorXd sums(residual.size() + 1);
  sums[0] = 0.0;
  for (Index i = 0; i < residual.size(); ++i) sums[i + 1] = sums[i] + residual[i];
  VectorXd statistic = VectorXd::Zero(residual.size());
  for (Index i = window; i + window <= residual.size(); ++i) {
    const Index start = starts[static_cast<std::size_t>(i)];
    if (i - window < start || starts[static_cast<std::size_t>(i + window - 1)] != start) continue;
    statistic[i] =
        (sums[i + window] - 2.0 * sums[i] + sums[i - window]) / static_cast<double>(window);
  }
  return statistic;
}

/// Half the width over which a step is looked for: four times as long as noise resembles itself.
Index window_of(Index count, double correlation_rows) {
  return std::clamp<Index>(static_cast<Index>(4.0 * correlation_rows), 20,
                           std::max<Index>(20, count / 16));
}

/// The statistic where it is greatest, and what it is elsewhere.
struct Peak {
  Index at = 0;
  double quantile99 = 0.0;   ///< elsewhere
  double independent = 0.0;  ///< values elsewhere, each as long as the two windows
  /// One standard deviation elsewhere: the 99 % quantile of a normal is 2.58 of them.
  [[nodiscard]] double deviation() const { return quantile99 / 2.58; }
};

std::optional<Peak> peak_of(const VectorXd& statistic, Index window) {
  Peak peak;
  statistic.cwiseAbs().maxCoeff(&peak.at);
  std::vector<double> elsewhere;
  for (Index i = 0; i < statistic.size(); ++i) {
    if (statistic[i] != 0.0 && std::abs(i - peak.at) > 2 * window)
      elsewhere.push_back(std::abs(statistic[i]));
  }
  if (elsewhere.size() < static_cast<std::size_t>(6 * window)) return std::nullopt;
  peak.independent = static_cast<double>(elsewhere.size()) / (2.0 * static_cast<double>(window));
  peak.quantile99 = core::upper_quantile(std::move(elsewhere), 0.99);
  return peak;
}

}  // namespace

double chance_anywhere(double t, double independent) {
  const double nu = std::max(1.0, independent);
  const double z = (8.0 * nu + 1.0) / (8.0 * nu + 3.0) * std::sqrt(nu * std::log1p(t * t / nu));
  return std::min(1.0, 2.0 * nu * std::erfc(z / std::sqrt(2.0)));
}

std::vector<Step> find_steps(const Series& series, const Blocks& blocks, const VectorXd& residual,
                             double correlation_rows) {
  std::vector<Step> steps;
  const Index count = residual.size();
  const Index window = window_of(count, correlation_rows);
  if (count < 12 * window) return steps;
  const auto starts = stretch_starts(series, blocks);
  VectorXd rest = residual;
  while (steps.size() < kMostSteps) {
    const VectorXd statistic = step_statistic(rest, starts, window);
    const auto peak = peak_of(statistic, window);
    if (!peak) break;
    const double size = statistic[peak->at];
    const double deviation = peak->deviation();
    const double chance =
        chance_anywhere(std::abs(size) / std::max(deviation, 1e-300), peak->independent);
    if (std::abs(size) < kStepRatio * peak->quantile99 || chance > kStepChance) break;
    const Index row = blocks.rows[static_cast<std::size_t>(peak->at)];
    steps.push_back(
        {row, series.t_s[row], size, deviation, std::abs(size) / peak->quantile99, chance, window});
    const Index start = starts[static_cast<std::size_t>(peak->at)];
    for (Index i = peak->at; i < count && starts[static_cast<std::size_t>(i)] == start; ++i)
      rest[i] -= size;
  }
  return steps;
}

std::optional<double> least_step(const Series& series, const Blocks& blocks,
                                 const VectorXd& residual, double correlation_rows) {
  const Index window = window_of(residual.size(), correlation_rows);
  if (residual.size() < 12 * window) return std::nullopt;
  const auto peak =
      peak_of(step_statistic(residual, stretch_starts(series, blocks), window), window);
  if (!peak) return std::nullopt;
  double deviations = 2.58 * kStepRatio;
  while (chance_anywhere(deviations, peak->independent) > kStepChance) deviations += 0.1;
  return (deviations + kNineInTen) * peak->deviation();
}

VectorXd step_column(const Series& series, const Step& step) {
  VectorXd column = VectorXd::Zero(series.rows());
  for (Index i = step.row; i < series.rows(); ++i) {
    if (i > step.row && series.fresh[static_cast<std::size_t>(i)] != 0) break;
    column[i] = 1.0;
  }
  return column;
}

}  // namespace ravencal::diagnose
