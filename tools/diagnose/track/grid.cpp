// SPDX-License-Identifier: Apache-2.0
#include "diagnose/track/grid.hpp"

#include <algorithm>
#include <cmath>

#include "core/median.hpp"
#include "diagnose/track/filter.hpp"
#include "diagnose/track/track.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using record::Recording;

/// Periods without a row after which a new episode begins.
constexpr double kLongestHole = 5.0;
constexpr Index kNone = -1;
/// Rows that motion gives, over the rests: a map's homing does not make it a motion.
constexpr double kMostMoving = 0.1;

double time_s(const Recording& recording, Index row) {
  return 1e-9 * static_cast<double>(recording.t_ns[static_cast<std::size_t>(row)] -
                                    recording.t_ns.front());
}

/// Says of samples in their order whether an episode or a homing began since the one before.
class Starts {
 public:
  explicit Starts(const Recording& recording) : recording_(recording) {
    for (const record::Event& event : recording.events)
      if (event.kind == "episode" || event.kind == "homing") starts_ns_.push_back(event.t_ns);
    std::sort(starts_ns_.begin(), starts_ns_.end());
  }

  bool before(Index sample) {
    bool any = false;
    const std::int64_t t_ns = recording_.t_ns[static_cast<std::size_t>(sample)];
    for (; next_ < starts_ns_.size() && starts_ns_[next_] <= t_ns; ++next_) any = true;
    return any;
  }

 private:
  const Recording& recording_;
  std::vector<std::int64_t> starts_ns_;
  std::size_t next_ = 0;
};

void set_times(const std::vector<double>& times_s, Grid& grid) {
  grid.t_s = Eigen::Map<const VectorXd>(times_s.data(), static_cast<Index>(times_s.size()));
  if (grid.rows() == 0) return;
  grid.begins_s = times_s.front();
  grid.t_s.array() -= times_s.front();
}

/// The rests of one recording.
class Rests {
 public:
  Rests(const Recording& recording, const std::vector<RecordedPosition>& positions, double hole_s)
      : recording_(recording), positions_(positions), hole_s_(hole_s) {}

  /// Samples of one episode, whose times never fall.
  void add(Index first, Index last) {
    begins_ = true;
    Index before = first, after = first;
    Index rest = kNone, motion = kNone;
    for (Index i = first; i < last; ++i) {
      const double t_s = time_s(recording_, i);
      while (before + 1 < i && time_s(recording_, before + 1) <= t_s - kStillS) ++before;
      while (after + 1 < last && (after <= i || time_s(recording_, after) < t_s + kStillS)) ++after;
      const double reach_s = time_s(recording_, after) - time_s(recording_, before);
      const bool still = within(before, after, std::max(1.0, reach_s / (2.0 * kStillS)));
      const bool hole = i > first && t_s - time_s(recording_, i - 1) > hole_s_;
      if (rest != kNone && !within(rest, i, 1.0)) {
        close(rest, i);
        rest = kNone;
      }
      if (still && rest == kNone) rest = i;
      if (motion != kNone && (rest != kNone || hole)) {
        moved(motion, i);
        motion = kNone;
      }
      if (rest == kNone && motion == kNone) motion = i;
    }
    if (rest != kNone) close(rest, last);
    if (motion != kNone) moved(motion, last);
  }

  std::optional<Grid> grid() && {
    const auto rests = static_cast<double>(times_s_.size());
    const double most = std::max(static_cast<double>(kFewestTrackRows), kMostMoving * rests);
    if (rests < static_cast<double>(kFewestTrackRows) || moving_rows_ > most) return std::nullopt;
    std::vector<double> steps_s;
    for (std::size_t i = 1; i < times_s_.size(); ++i)
      if (grid_.fresh[i] == 0) steps_s.push_back(times_s_[i] - times_s_[i - 1]);
    if (steps_s.empty()) return std::nullopt;
    grid_.period_s = core::upper_median(std::move(steps_s));
    set_times(times_s_, grid_);
    grid_.at_rest = true;
    return std::move(grid_);
  }

 private:
  /// Whether no position differs between the two by so many least moves.
  [[nodiscard]] bool within(Index one, Index other, double least_moves) const {
    return std::all_of(positions_.begin(), positions_.end(), [&](const RecordedPosition& p) {
      const auto& x = recording_.samples.col(p.column);
      return std::abs(x[other] - x[one]) < least_moves * p.least_move;
    });
  }

  void close(Index begin, Index end) {
    grid_.first.push_back(begin);
    grid_.samples.push_back(end - begin);
    grid_.fresh.push_back(begins_ ? 1 : 0);
    times_s_.push_back(0.5 * (time_s(recording_, begin) + time_s(recording_, end - 1)));
    begins_ = false;
  }

  /// Beside a rest the filter leaves no row of a motion.
  void moved(Index begin, Index end) {
    const double length_s = time_s(recording_, end - 1) - time_s(recording_, begin);
    moving_rows_ += std::max(0.0, length_s - 2.0 * (kTentS + kStillS)) / kTentS;
  }

  const Recording& recording_;
  const std::vector<RecordedPosition>& positions_;
  double hole_s_;  ///< a longer step between samples hides what moved
  Grid grid_;
  std::vector<double> times_s_;
  double moving_rows_ = 0.0;
  bool begins_ = false;
};

}  // namespace

Grid grid_of(const Recording& recording, double from_s, double to_s) {
  std::vector<double> steps;
  for (Index i = 1; i < std::min<Index>(recording.rows(), 2000); ++i)
    steps.push_back(time_s(recording, i) - time_s(recording, i - 1));
  const double usual_s = steps.empty() ? 0.0 : core::upper_median(std::move(steps));
  Grid grid;
  if (!(usual_s > 0.0)) return grid;
  const Index stride = std::max<Index>(1, std::lround(1.0 / (kWorkingRateHz * usual_s)));
  grid.period_s = usual_s * static_cast<double>(stride);
  std::vector<double> times_s;
  Starts starts(recording);
  for (Index i = 0; i + stride <= recording.rows(); i += stride) {
    const double t_s = time_s(recording, i);
    if (t_s < from_s || t_s >= to_s) continue;
    const double step_s = times_s.empty() ? 0.0 : t_s - times_s.back();
    const bool begins = starts.before(i);
    times_s.push_back(t_s);
    grid.fresh.push_back(begins || !(step_s > 0.0) || step_s > kLongestHole * grid.period_s ? 1
                                                                                            : 0);
    grid.first.push_back(i);
    grid.samples.push_back(stride);
  }
  set_times(times_s, grid);
  // A row is the mean of its samples.
  grid.begins_s += 0.5 * (grid.period_s - usual_s);
  return grid;
}

std::optional<Grid> rests_of(const Recording& recording,
                             const std::vector<RecordedPosition>& positions, double period_s,
                             double from_s, double to_s) {
  if (positions.empty()) return std::nullopt;
  Rests rests(recording, positions, kLongestHole * period_s);
  Starts starts(recording);
  const auto inside = [&](Index i) {
    const double t_s = time_s(recording, i);
    return t_s >= from_s && t_s < to_s;
  };
  for (Index first = 0; first < recording.rows();) {
    Index last = first + 1;
    if (inside(first)) {
      while (last < recording.rows() && inside(last) && !starts.before(last) &&
             time_s(recording, last) >= time_s(recording, last - 1))
        ++last;
      rests.add(first, last);
    }
    first = last;
  }
  return std::move(rests).grid();
}

}  // namespace ravencal::diagnose
