// SPDX-License-Identifier: Apache-2.0
#include "diagnose/model/pulses.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/median.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Distance of two levels in deviations of the rows from theirs. A normal distribution cut in two
/// has halves that are 2.7 apart.
constexpr double kLevelsApart = 5.0;
/// Cells of position, in either direction of motion.
constexpr int kCells = 8;
/// Share of the rows that the cell puts at the right level, of those of which the rarer level alone
/// says nothing: beyond it the level belongs to the motion, as friction or weight in a law does.
constexpr double kOfMotion = 0.5;

struct Levels {
  double off = 0.0, on = 0.0;

  [[nodiscard]] double middle() const { return 0.5 * (off + on); }
  [[nodiscard]] bool is_on(double value) const { return (value > middle()) == (on > off); }
};

bool counts(const Track& track, std::size_t joint, Index row) {
  return track.lost[joint][static_cast<std::size_t>(row)] == 0;
}

/// Where the sorted values part into two groups with the least squares within each.
std::size_t best_cut(const std::vector<double>& sorted) {
  const double all = std::accumulate(sorted.begin(), sorted.end(), 0.0);
  const auto count = static_cast<double>(sorted.size());
  std::size_t best = 0;
  double greatest = 0.0, below = 0.0;
  for (std::size_t n = 1; n < sorted.size(); ++n) {
    below += sorted[n - 1];
    const auto low = static_cast<double>(n);
    const double between = below * below / low + (all - below) * (all - below) / (count - low);
    if (best != 0 && between <= greatest) continue;
    greatest = between;
    best = n;
  }
  return best;
}

/// By medians, since filtered edges lie between the levels.
std::optional<Levels> levels_of(std::vector<double> values) {
  if (values.size() < 2) return std::nullopt;
  std::sort(values.begin(), values.end());
  const auto cut = values.begin() + static_cast<std::ptrdiff_t>(best_cut(values));
  std::vector<double> low(values.begin(), cut), high(cut, values.end());
  Levels levels{core::upper_median(low), core::upper_median(high)};
  const double deviation = std::max(core::normal_deviation(std::move(low), levels.off),
                                    core::normal_deviation(std::move(high), levels.on));
  if (!(levels.on - levels.off > kLevelsApart * deviation)) return std::nullopt;
  if (std::abs(levels.on) < std::abs(levels.off)) std::swap(levels.on, levels.off);
  return levels;
}

/// From and to where the middle is passed between rows, or to the ends of what was recorded.
std::vector<Interval> pulses_of(const Track& track, std::size_t joint, const VectorXd& left,
                                const Levels& levels) {
  const VectorXd& t_s = track.forced.t_s;
  const auto is_on = [&](Index i) { return counts(track, joint, i) && levels.is_on(left[i]); };
  /// Rows i and i + 1 follow each other.
  const auto follows = [&](Index i) {
    return i >= 0 && i + 1 < left.size() &&
           track.forced.fresh[static_cast<std::size_t>(i + 1)] == 0;
  };
  const auto passed_s = [&](Index i) {
    return t_s[i] + (t_s[i + 1] - t_s[i]) * (levels.middle() - left[i]) / (left[i + 1] - left[i]);
  };
  std::vector<Interval> out;
  for (Index i = 0; i < left.size(); ++i) {
    if (!is_on(i)) continue;
    const Index first = i;
    while (follows(i) && is_on(i + 1)) ++i;
    const bool begins = follows(first - 1) && counts(track, joint, first - 1);
    const bool ends = follows(i) && counts(track, joint, i + 1);
    out.emplace_back(begins ? passed_s(first - 1) : t_s[first], ends ? passed_s(i) : t_s[i]);
  }
  return out;
}

/// Whether position and direction of motion say which level it is.
bool told_by_motion(const std::vector<Track>& tracks, std::size_t joint,
                    const std::vector<VectorXd>& left, const Levels& levels) {
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  for (const Track& track : tracks) {
    lowest = std::min(lowest, track.forced.motors[joint].q.minCoeff());
    highest = std::max(highest, track.forced.motors[joint].q.maxCoeff());
  }
  const double width = std::max(1e-300, highest - lowest) / kCells;
  std::array<std::array<double, 2>, 2 * kCells> rows{};  // [cell][on]
  for (std::size_t r = 0; r < left.size(); ++r) {
    const physics::Motion& motor = tracks[r].forced.motors[joint];
    for (Index i = 0; i < left[r].size(); ++i) {
      if (!counts(tracks[r], joint, i)) continue;
      const auto place = std::min(kCells - 1, static_cast<int>((motor.q[i] - lowest) / width));
      const auto cell = static_cast<std::size_t>(2 * place + (motor.v[i] > 0.0 ? 1 : 0));
      rows[cell][levels.is_on(left[r][i]) ? 1 : 0] += 1.0;
    }
  }
  double off = 0.0, on = 0.0, wrong = 0.0;
  for (const auto& cell : rows) {
    off += cell[0];
    on += cell[1];
    wrong += std::min(cell[0], cell[1]);
  }
  return wrong < (1.0 - kOfMotion) * std::min(off, on);
}

}  // namespace

std::optional<Pulses> pulses_in(const std::vector<Track>& tracks, std::size_t joint,
                                const std::vector<VectorXd>& left) {
  std::vector<double> values;
  for (std::size_t r = 0; r < left.size(); ++r)
    for (Index i = 0; i < left[r].size(); ++i)
      if (counts(tracks[r], joint, i)) values.push_back(left[r][i]);
  const std::optional<Levels> levels = levels_of(std::move(values));
  if (!levels) return std::nullopt;
  Pulses out{levels->on - levels->off, {}};
  for (std::size_t r = 0; r < left.size(); ++r)
    out.on_s.push_back(pulses_of(tracks[r], joint, left[r], *levels));
  if (told_by_motion(tracks, joint, left, *levels)) return std::nullopt;
  return out;
}

VectorXd share_on(const Track& track, const std::vector<Interval>& on_s) {
  VectorXd out = VectorXd::Zero(track.rows());
  const double half_s = 0.5 * track.period_s;
  for (Index i = 0; i < out.size(); ++i) {
    const double t_s = track.forced.t_s[i];
    for (const auto& [begin_s, end_s] : on_s)
      out[i] += std::max(0.0, std::min(end_s, t_s + half_s) - std::max(begin_s, t_s - half_s)) /
                track.period_s;
  }
  return out;
}

}  // namespace ravencal::diagnose
