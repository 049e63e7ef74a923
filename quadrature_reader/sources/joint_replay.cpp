// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/sources/joint_replay.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "quadrature_reader/decoder.hpp"

namespace ravencal::quadrature_reader {
namespace {

constexpr unsigned kWholeBits = 64;
// Counters of 16 and 32 bits are those of timers and drives, of 24 those of quadrature chips.
constexpr unsigned kCounterBits[] = {16, 24, 32};
// A joint that a default limit would refuse may be this much faster than its own steady speed.
constexpr double kSteadySpeedMargin = 2.0;
// One jump or wrap among so many steps does not reach their median, two do not either.
constexpr std::size_t kSteadySteps = 5;
// The pace of the edges before a gap: as many as one cycle of A and B has, and the first.
constexpr std::size_t kPaceEdges = 5;
// After longer the joint has more likely rested than kept its pace, and nothing says how many
// edges are missing.
constexpr std::int64_t kLongestPacedGapNs = 1'000'000'000;
// Where no limit is given: more than any joint moves, and far below what overflows.
constexpr double kLargestMovementCounts = 1e12;

/// The whole number, if it is one that a double holds exactly.
std::optional<std::int64_t> whole(double value) {
  constexpr double kLargest = 9e15;
  if (!(std::abs(value) <= kLargest)) return std::nullopt;
  return static_cast<std::int64_t>(std::llround(value));
}

/// The largest speed that several steps in a row share, counts/s.
double steady_speed(std::span<const std::int64_t> t_ns, std::span<const double> counts) {
  std::vector<double> speeds;
  for (std::size_t i = 1; i < counts.size(); ++i) {
    const double step = std::abs(counts[i] - counts[i - 1]);
    if (std::isfinite(step)) speeds.push_back(step / reach_counts(1.0, t_ns[i] - t_ns[i - 1]));
  }
  double largest = 0.0;
  for (std::size_t i = 0; i + kSteadySteps <= speeds.size(); ++i) {
    double steps[kSteadySteps];
    std::copy_n(speeds.begin() + static_cast<std::ptrdiff_t>(i), kSteadySteps, steps);
    std::nth_element(steps, steps + kSteadySteps / 2, steps + kSteadySteps);
    largest = std::max(largest, steps[kSteadySteps / 2]);
  }
  return largest;
}

double limit_of(const CountLimit& limit, std::span<const std::int64_t> t_ns,
                std::span<const double> counts) {
  if (limit.said || limit.counts_per_s <= 0.0) return limit.counts_per_s;
  return std::max(limit.counts_per_s, kSteadySpeedMargin * steady_speed(t_ns, counts));
}

}  // namespace

void LinesReplay::take(std::int64_t t_ns, double levels, double count, std::vector<Reading>& out) {
  const auto now = whole(levels);
  if (!now) {
    if (levels_) out.push_back({t_ns, 0, axis_, ReadingKind::kLost, Line::kA, Fault::kNone});
    levels_.reset();
    return;
  }
  const std::int64_t levels_now = *now & 7;
  const auto count_now = whole(count);
  if (!levels_) {
    out.push_back({t_ns, levels_now, axis_, ReadingKind::kLevels, Line::kA, Fault::kNone});
    begin_pace(t_ns);
  } else if (const auto missing = missing_at(t_ns, levels_now, count_now)) {
    out.push_back(*missing);
    out.push_back({t_ns, levels_now, axis_, ReadingKind::kLevels, Line::kA, Fault::kNone});
    if (missing->kind == ReadingKind::kUnseen) direction_ = missing->value > 0 ? 1 : -1;
    begin_pace(t_ns);
  } else {
    put_edges(t_ns, levels_now, out);
  }
  levels_ = levels_now;
  count_ = count_now;
}

std::optional<Reading> LinesReplay::missing_at(std::int64_t t_ns, std::int64_t levels,
                                               std::optional<std::int64_t> count) const {
  const auto reading = [&](ReadingKind kind, std::int64_t value, Fault fault) {
    return Reading{t_ns, value, axis_, kind, Line::kA, fault};
  };
  const std::int64_t step = phase_step(*levels_, levels);
  // Counts that do not follow the lines are another encoder's.
  if (count && count_ && (*count - *count_ - step) % 4 == 0) {
    const std::int64_t counted = *count - *count_;
    const double reach = max_counts_per_s_ > 0.0
                             ? reach_counts(max_counts_per_s_, t_ns - edges_t_ns_.back())
                             : kLargestMovementCounts;
    if (static_cast<double>(std::abs(counted)) > reach)
      return reading(ReadingKind::kLost, std::abs(counted), Fault::kImplausibleCount);
    if (std::abs(counted) <= 1) return std::nullopt;
    return reading(ReadingKind::kUnseen, counted, Fault::kMissingRows);
  }
  if (step != 2) return std::nullopt;
  const std::int64_t movement = movement_by_pace(t_ns);
  return reading(movement == 0 ? ReadingKind::kLost : ReadingKind::kUnseen, movement,
                 Fault::kInvalidTransition);
}

std::int64_t LinesReplay::movement_by_pace(std::int64_t t_ns) const {
  const std::int64_t gap_ns = t_ns - edges_t_ns_.back();
  if (gap_ns > kLongestPacedGapNs) return 0;
  const std::int64_t span_ns = edges_t_ns_.back() - edges_t_ns_.front();
  std::int64_t movement = 2;
  if (span_ns > 0) {
    const double edges = static_cast<double>(gap_ns) / static_cast<double>(span_ns) *
                         static_cast<double>(edges_t_ns_.size() - 1);
    movement += 4 * std::max<std::int64_t>(0, std::llround((edges - 2.0) / 4.0));
  }
  return direction_ < 0 ? -movement : movement;
}

void LinesReplay::put_edges(std::int64_t t_ns, std::int64_t levels, std::vector<Reading>& out) {
  for (unsigned line = 0; line < 3; ++line) {
    if ((((levels ^ *levels_) >> line) & 1) == 0) continue;
    out.push_back({t_ns, (levels >> line) & 1, axis_, ReadingKind::kEdge, static_cast<Line>(line),
                   Fault::kNone});
  }
  const std::int64_t step = phase_step(*levels_, levels);
  if (step == 0) return;
  if (step != direction_) begin_pace(edges_t_ns_.back());
  direction_ = step;
  edges_t_ns_.push_back(t_ns);
  if (edges_t_ns_.size() > kPaceEdges) edges_t_ns_.erase(edges_t_ns_.begin());
}

CountsReplay::CountsReplay(std::uint8_t axis, const CountLimit& limit,
                           std::span<const std::int64_t> t_ns, std::span<const double> counts)
    : axis_(axis),
      max_counts_per_s_(limit_of(limit, t_ns, counts)),
      follower_(kWholeBits, true, max_counts_per_s_) {
  double lowest = INFINITY;
  double highest = -INFINITY;
  for (const double count : counts) {
    if (!whole(count)) continue;
    lowest = std::min(lowest, count);
    highest = std::max(highest, count);
  }
  range_counts_ = highest - lowest;
}

void CountsReplay::take(std::int64_t t_ns, double count, std::vector<Reading>& out) {
  const auto put = [&](ReadingKind kind, std::int64_t value, Fault fault) {
    out.push_back({t_ns, value, axis_, kind, Line::kA, fault});
  };
  const auto now = whole(count);
  if (!now) {
    if (believed_ && !lost_) put(ReadingKind::kLost, 0, Fault::kNone);
    lost_ = true;
    return;
  }
  std::int64_t value = *now + unwrapped_counts_;
  if (believed_) {
    const std::int64_t wrap = unwrapping(value - believed_->count, t_ns - believed_->t_ns);
    if (wrap != 0) put(ReadingKind::kWrapped, wrap, Fault::kNone);
    unwrapped_counts_ += wrap;
    value += wrap;
  }
  if (std::exchange(lost_, false)) {
    follower_ = CountFollower(kWholeBits, true, max_counts_per_s_);
    delivered_.reset();
  }
  const auto step = follower_.take(t_ns, static_cast<std::uint64_t>(value));
  if (step.outcome == CountFollower::Outcome::kImplausible) {
    return put(ReadingKind::kLost, 1, Fault::kImplausibleCount);
  }
  if (step.outcome == CountFollower::Outcome::kRestarted) {
    put(ReadingKind::kRestarted, step.moved, Fault::kImplausibleCount);
    delivered_.reset();
  }
  believed_ = Counted{t_ns, value};
  if (delivered_ == step.count) return;
  put(ReadingKind::kCount, step.count, Fault::kNone);
  delivered_ = step.count;
}

std::int64_t CountsReplay::unwrapping(std::int64_t step, std::int64_t dt_ns) const {
  const double reach = reach_counts(max_counts_per_s_, dt_ns);
  const auto distance = static_cast<double>(std::abs(step));
  if (max_counts_per_s_ <= 0.0 || distance <= reach) return 0;
  for (const unsigned bits : kCounterBits) {
    const std::int64_t width = std::int64_t{1} << bits;
    // A counter of that width never shows counts further apart.
    if (range_counts_ >= static_cast<double>(width)) continue;
    if (std::abs(distance - static_cast<double>(width)) <= reach) return step > 0 ? -width : width;
  }
  return 0;
}

}  // namespace ravencal::quadrature_reader
