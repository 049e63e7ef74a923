// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnose/model/likelihood.hpp"
#include "diagnose/track/filter.hpp"
#include "diagnose/track/grid.hpp"

namespace ravencal::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

/// Cables and friction forget how a recording began.
constexpr double kForgottenS = 1.0;
/// Around a reversal, where presliding and quanta decide: half widths beyond the filter, and the
/// further variance in variances of the noise.
constexpr double kTurnDriveS = 0.06;
constexpr double kTurnPositionS = 0.08;
constexpr double kTurnDriveDoubt = 30.0;
constexpr double kTurnPositionDoubt = 3.0;

Index rows_in(double seconds, const Track& track) {
  return std::max<Index>(1, std::lround(seconds / track.period_s));
}

template <typename Mark>
void mark_around(Index centre, Index reach, Index rows, Mark&& mark) {
  for (Index i = std::max<Index>(0, centre - reach); i <= std::min(rows - 1, centre + reach); ++i)
    mark(static_cast<std::size_t>(i));
}

/// A rest from which the joint did not move to the next one says nothing of the side on which
/// friction acts.
void leave_out_unmoved(const Track& track, std::size_t joint, std::vector<char>& used) {
  const VectorXd& q = track.forced.motors[joint].q;
  for (Index i = 1; i < q.size(); ++i)
    if (std::abs(q[i] - q[i - 1]) < track.joints[joint].quantum)
      used[static_cast<std::size_t>(i)] = 0;
}

/// At rest dry friction is whatever the effort asks.
void leave_out_rest(const Track& track, std::size_t joint, std::vector<char>& used) {
  const VectorXd& q = track.forced.motors[joint].q;
  const Index reach = rows_in(kStillS, track);
  const double least = kStillQuanta * track.joints[joint].quantum;
  for (Index i = 0; i < q.size(); ++i) {
    const double moved = q[std::min(q.size() - 1, i + reach)] - q[std::max<Index>(0, i - reach)];
    if (std::abs(moved) < least)
      mark_around(i, track.tent_rows + reach, q.size(), [&](std::size_t n) { used[n] = 0; });
  }
}

void doubt_turns(const Track& track, std::size_t joint, double reach_s, double doubt,
                 std::vector<double>& doubts) {
  const VectorXd& v = track.forced.motors[joint].v;
  const Index reach = track.tent_rows + rows_in(reach_s, track);
  for (Index i = 1; i < v.size(); ++i) {
    if (v[i] * v[i - 1] <= 0.0)
      mark_around(i, reach, v.size(), [&](std::size_t n) { doubts[n] = doubt; });
  }
}

}  // namespace

void leave_out_lost(const Track& track, const VectorXd& signal, std::vector<char>& used) {
  for (Index i = 0; i < signal.size(); ++i) {
    if (!std::isfinite(signal[i]))
      mark_around(i, track.tent_rows, signal.size(), [&](std::size_t n) { used[n] = 0; });
  }
}

NoiseRows rows_of(const Track& track, std::size_t joint, ChannelKind kind,
                  const physics::Plant& plant) {
  const auto count = static_cast<std::size_t>(track.rows());
  NoiseRows rows{std::vector<char>(count, 0), std::vector<double>(count, 0.0), track.period_s,
                 track.forced.fresh};
  double begun_s = 0.0;
  // Nothing is known of the side from which the first rest was approached.
  const double forgotten_s = track.at_rest ? std::numeric_limits<double>::min() : kForgottenS;
  const double ends_s = track.forced.t_s[track.rows() - 1] - (track.at_rest ? 0.0 : kTentS);
  for (Index i = 0; i < track.rows(); ++i) {
    const double t_s = track.forced.t_s[i];
    if (track.forced.fresh[static_cast<std::size_t>(i)] != 0) begun_s = t_s;
    // One row per width of the filter: others say the same again.
    const bool sampled = i % track.tent_rows == 0 && t_s - begun_s >= forgotten_s && t_s <= ends_s;
    rows.used[static_cast<std::size_t>(i)] = sampled ? 1 : 0;
  }
  const Index reach = track.at_rest ? 0 : track.tent_rows;
  for (Index i = 0; i < track.rows(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    // The filter reaches into the episode before.
    if (track.lost[joint][at] != 0 || (i > 0 && track.forced.fresh[at] != 0))
      mark_around(i, reach, track.rows(), [&](std::size_t n) { rows.used[n] = 0; });
  }
  if (kind == ChannelKind::kDrive) {
    if (track.at_rest)
      leave_out_unmoved(track, joint, rows.used);
    else
      leave_out_rest(track, joint, rows.used);
    if (plant.joints[joint].find_effect("presliding") == nullptr)
      doubt_turns(track, joint, kTurnDriveS, kTurnDriveDoubt, rows.doubt);
  }
  if (kind == ChannelKind::kPosition)
    doubt_turns(track, joint, kTurnPositionS, kTurnPositionDoubt, rows.doubt);
  return rows;
}

}  // namespace ravencal::diagnose
