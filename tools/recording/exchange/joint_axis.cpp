// SPDX-License-Identifier: Apache-2.0
#include "exchange/joint_axis.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdlib>
#include <limits>
#include <numbers>

#include "core/median.hpp"

namespace ravencal::exchange {
namespace {

/// Nothing is interpolated across more of its median periods: fewer lost messages are usual on a
/// network, more are an outage. No source: a choice.
constexpr std::int64_t kMostLostPeriods = 5;
/// Nor across more than this where its periods are shorter: what `ravencal merge` allows a truth.
constexpr std::int64_t kLongestGapNs = 50'000'000;
/// Two publishers have one rate if their numbers of messages differ by at most this share, which
/// leaves room for lost ones. No source: a choice, as the next.
constexpr double kLostShare = 0.2;
/// Length of the mean of the delays as directions, a period being a turn: 1 where all are equal, 0
/// where two clocks run past each other.
constexpr double kSteadyDelay = 0.5;
/// Share of a period by which stamps of one sweep may be against its order. No source: a choice.
constexpr double kAgainstOrder = 0.05;
constexpr std::size_t kFewestOfSweep = 3;

std::int64_t median_step_ns(std::span<const std::int64_t> t_ns) {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < t_ns.size(); ++i) steps.push_back(t_ns[i] - t_ns[i - 1]);
  return core::upper_median(std::move(steps));
}

/// Usual delay of the messages behind the rows, less than a period.
std::optional<std::int64_t> steady_delay_ns(std::span<const std::int64_t> row_t_ns,
                                            std::span<const std::int64_t> t_ns,
                                            std::int64_t period_ns, bool is_first) {
  std::complex<double> sum = 0.0;
  std::size_t row = 0;
  for (const std::int64_t now_ns : t_ns) {
    while (row + 1 < row_t_ns.size() && row_t_ns[row + 1] <= now_ns) ++row;
    const double turns =
        static_cast<double>(now_ns - row_t_ns[row]) / static_cast<double>(period_ns);
    sum += std::polar(1.0, 2.0 * std::numbers::pi * (turns - std::floor(turns)));
  }
  if (std::abs(sum) < kSteadyDelay * static_cast<double>(t_ns.size())) return std::nullopt;
  double turns = std::arg(sum) / (2.0 * std::numbers::pi);
  if (is_first && turns > kAgainstOrder) turns -= 1.0;
  if (!is_first && turns < -kAgainstOrder) turns += 1.0;
  return std::llround(turns * static_cast<double>(period_ns));
}

}  // namespace

std::vector<double> interpolated(std::span<const std::int64_t> t_ns, std::span<const double> values,
                                 std::span<const std::int64_t> at_ns) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max() / kMostLostPeriods;
  const std::int64_t longest_ns =
      std::max(kMostLostPeriods * std::min(median_step_ns(t_ns), kMost), kLongestGapNs);
  std::vector<double> found;
  std::size_t next = 0;
  for (const std::int64_t now_ns : at_ns) {
    while (next < t_ns.size() && t_ns[next] < now_ns) ++next;
    if (next == t_ns.size() || (next == 0 && t_ns[0] != now_ns)) {
      found.push_back(kLost);
    } else if (t_ns[next] == now_ns) {
      found.push_back(values[next]);
    } else {
      const std::int64_t before_ns = t_ns[next - 1];
      const std::int64_t gap_ns = t_ns[next] - before_ns;
      const double share = static_cast<double>(now_ns - before_ns) / static_cast<double>(gap_ns);
      const double before = values[next - 1];
      found.push_back(gap_ns > longest_ns ? kLost : before + share * (values[next] - before));
    }
  }
  return found;
}

std::optional<std::vector<std::optional<std::size_t>>> sweep_of(
    std::span<const std::int64_t> row_t_ns, std::span<const std::int64_t> t_ns, bool is_first) {
  const auto rows = static_cast<double>(row_t_ns.size());
  const double differ = std::abs(static_cast<double>(t_ns.size()) - rows);
  if (std::min(t_ns.size(), row_t_ns.size()) < kFewestOfSweep || differ > kLostShare * rows)
    return std::nullopt;
  const std::int64_t period_ns = median_step_ns(row_t_ns);
  if (period_ns <= 0) return std::nullopt;
  const auto delay_ns = steady_delay_ns(row_t_ns, t_ns, period_ns, is_first);
  if (!delay_ns) return std::nullopt;
  std::vector<std::optional<std::size_t>> sweep(row_t_ns.size());
  std::size_t row = 0;
  const auto off_ns = [&](std::size_t r, std::size_t i) {
    return std::abs(t_ns[i] - *delay_ns - row_t_ns[r]);
  };
  for (std::size_t i = 0; i < t_ns.size(); ++i) {
    while (row + 1 < row_t_ns.size() && off_ns(row + 1, i) <= off_ns(row, i)) ++row;
    if (off_ns(row, i) > period_ns / 2) continue;
    if (!sweep[row] || off_ns(row, i) < off_ns(row, *sweep[row])) sweep[row] = i;
  }
  return sweep;
}

}  // namespace ravencal::exchange
