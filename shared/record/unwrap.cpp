// SPDX-License-Identifier: Apache-2.0
#include "record/unwrap.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/median.hpp"
#include "core/units.hpp"
#include "record/table_truth.hpp"

namespace ravencal::record {
namespace {

/// A counter's values lie within one turn. What is further from both neighbours than this many
/// turns is no value of the counter; the excess over 1 is room for rounding.
constexpr double kBeyondTurns = 1.05;
/// Only a value that lies further than so many turns from both neighbours, there and back, can put
/// the next one on a wrong turn.
constexpr double kWildTurns = 0.25;
/// Widths are equal within so much of them: scales are written with a few digits.
constexpr double kSameWidth = 1e-3;

/// The values that count, with the steps between them on the nearest turn.
class Counter {
 public:
  Counter(std::span<double> values, std::span<const std::int64_t> t_ns, double turn)
      : values_(values), t_ns_(t_ns), turn_(turn) {}

  std::size_t unwrap() {
    find_rows();
    if (rows_.empty()) return 0;
    for (std::size_t k = 0; k + 1 < rows_.size(); ++k) {
      const double step = values_[rows_[k + 1]] - values_[rows_[k]];
      const double nearest = step - turn_ * std::round(step / turn_);
      steps_.push_back(std::isfinite(nearest) ? nearest : step);  // a turn of hardly anything
    }
    wild_.assign(rows_.size(), 0);
    for (std::size_t k = 1; k + 1 < rows_.size(); ++k) pass_wild(k);
    return put();
  }

 private:
  void find_rows() {
    std::vector<std::size_t> finite;
    for (std::size_t row = 0; row < values_.size(); ++row)
      if (std::isfinite(values_[row])) finite.push_back(row);
    const auto far = [&](std::size_t a, std::size_t b) {
      return std::abs(values_[finite[a]] - values_[finite[b]]) > kBeyondTurns * turn_;
    };
    for (std::size_t k = 0; k < finite.size(); ++k) {
      const bool has_before = k > 0, has_after = k + 1 < finite.size();
      const bool beyond = (has_before || has_after) && (!has_before || far(k, k - 1)) &&
                          (!has_after || far(k, k + 1));
      if (!beyond) rows_.push_back(finite[k]);
    }
  }

  [[nodiscard]] double between_ns(std::size_t from, std::size_t to) const {
    return static_cast<double>(t_ns_[rows_[to]] - t_ns_[rows_[from]]);
  }

  /// By the motion before and after it, a value k that lies far from both neighbours is wild where
  /// its neighbours lie near each other. Two long steps of one fast motion are no wild value.
  void pass_wild(std::size_t k) {
    double &there = steps_[k - 1], &back = steps_[k];
    if (std::min(std::abs(there), std::abs(back)) <= kWildTurns * turn_) return;
    double travel = 0.0, time_ns = 0.0;
    if (k >= 2) travel += steps_[k - 2], time_ns += between_ns(k - 2, k - 1);
    if (k + 2 < rows_.size()) travel += steps_[k + 1], time_ns += between_ns(k + 1, k + 2);
    const double expected = time_ns > 0.0 ? travel / time_ns * between_ns(k - 1, k + 1) : 0.0;
    const double sum = there + back;
    const double excess = turn_ * std::round((sum - expected) / turn_);
    if (std::abs(sum - excess) >= std::min(std::abs(there), std::abs(back))) return;
    wild_[k] = 1;
    back -= excess;
  }

  /// Adds whole turns, so that no rounding grows with their number.
  std::size_t put() {
    std::size_t wraps = 0;
    double turns = 0.0, counted = 0.0;
    std::size_t k = 0;
    double last = values_[rows_.front()];
    for (std::size_t row = rows_.front(); row < values_.size(); ++row) {
      if (k < rows_.size() && rows_[k] == row) {
        const double value = values_[row];
        if (k > 0) turns += std::round((steps_[k - 1] - (value - last)) / turn_);
        if (!wild_[k] && turns != counted) {
          ++wraps;
          counted = turns;
        }
        last = value;
        ++k;
      }
      values_[row] += turns * turn_;
    }
    return wraps;
  }

  std::span<double> values_;
  std::span<const std::int64_t> t_ns_;
  double turn_;
  std::vector<std::size_t> rows_;
  std::vector<double> steps_;  ///< [k]: from rows_[k] to rows_[k + 1]
  std::vector<char> wild_;
};

/// SI width of a channel's counter; 0: it does not wrap.
double turn_of(const ProfileChannel& channel) {
  return channel.wraps_at * std::abs(channel.scale) * core::find_unit(channel.channel.unit)->to_si;
}

std::span<double> part_of(Recording& recording, std::size_t channel, std::size_t from,
                          std::size_t to) {
  return {recording.samples.col(static_cast<Eigen::Index>(channel)).data() + from, to - from};
}

void bring_near(std::span<double> values, std::span<const double> reference, double turn) {
  std::vector<double> apart;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (std::isfinite(values[i] - reference[i])) apart.push_back(reference[i] - values[i]);
  if (apart.empty()) return;
  const double turns = std::round(core::upper_median(std::move(apart)) / turn);
  if (turns == 0.0) return;
  for (double& value : values) value += turns * turn;
}

}  // namespace

std::size_t unwrap(std::span<double> values, std::span<const std::int64_t> t_ns, double turn) {
  return Counter(values, t_ns, turn).unwrap();
}

void unwrap_channels(Recording& recording, const Profile& profile,
                     std::span<const char> episode_start) {
  const std::vector<std::size_t> bounds = episode_bounds(episode_start);
  const auto& channels = profile.channels;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const double turn = turn_of(channels[c]);
    if (!(turn > 0.0)) continue;
    const auto first = std::find_if(channels.begin(), channels.end(), [&](const auto& other) {
      return !other.channel.joint.empty() && other.channel.joint == channels[c].channel.joint &&
             std::abs(turn_of(other) - turn) <= kSameWidth * turn;
    });
    const auto reference = static_cast<std::size_t>(first - channels.begin());
    std::size_t wraps = 0;
    for (std::size_t e = 0; e + 1 < bounds.size(); ++e) {
      const std::size_t from = bounds[e], to = bounds[e + 1];
      const std::span<double> values = part_of(recording, c, from, to);
      wraps += unwrap(values, std::span(recording.t_ns).subspan(from, to - from), turn);
      if (reference < c) bring_near(values, part_of(recording, reference, from, to), turn);
    }
    if (wraps == 0) continue;
    recording.events.push_back(
        {recording.t_ns.front(), "unwrapped",
         fmt::format("{} wraps at {:g} in the file; unwrapped {} time{}", channels[c].channel.name,
                     channels[c].wraps_at, wraps, wraps == 1 ? "" : "s")});
  }
}

}  // namespace ravencal::record
