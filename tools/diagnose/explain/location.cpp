// SPDX-License-Identifier: Apache-2.0
//
// Where and when the given plant and the recordings part: in which circumstances, at which
// positions and in which stretches of time.
#include "diagnose/explain/parts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/median.hpp"
#include "diagnose/explain/circumstances.hpp"
#include "diagnose/findings/policy.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// A stretch holds this share of the excess...
constexpr double kHeldShare = 0.9;
/// ...and reaches on over cells that have this share of its excess per row: 90 % of what lasts
/// would else begin or end anywhere.
constexpr double kReachesOn = 0.25;
constexpr int kPositionCells = 40;
/// A recording with less than this share of the usual excess per row has no stretch of it.
constexpr double kLeastOfRecording = 0.25;
constexpr Index kFewestInRegime = 10;

/// Squared error of each row beyond what is left or, where no plant can hold what was found, beyond
/// the floor.
struct Excess {
  VectorXd squares;
  double mean = 0.0;   ///< squared
  double floor = 0.0;  ///< RMS
};

Excess excess_of(const Channel& channel, const View& view, std::size_t c, bool beyond_plants) {
  const VectorXd before = used_rows(channel, view.before[c]);
  const VectorXd after = used_rows(channel, view.after[c]);
  const double left = rms(channel, view.after[c]);
  Excess out{before.cwiseAbs2() - after.cwiseAbs2(), 0.0, left};
  if (beyond_plants || !(out.squares.sum() > 0.0)) {
    out.floor = std::min(left, channel.floor);
    out.squares = before.array().square() - out.floor * out.floor;
  }
  out.mean = out.squares.size() > 0 ? std::max(0.0, out.squares.mean()) : 0.0;
  return out;
}

/// Excess and rows of each cell of a circumstance.
struct Cells {
  VectorXd excess, rows;

  explicit Cells(Index count) : excess(VectorXd::Zero(count)), rows(VectorXd::Zero(count)) {}
  void add(Index cell, double square) {
    excess[cell] += square;
    rows[cell] += 1.0;
  }
};

/// First and last cell.
using Stretch = std::pair<Index, Index>;

/// The shortest stretch that holds most of what exceeds, and what belongs to it on either side.
std::optional<Stretch> stretch_of(const Cells& cells) {
  const VectorXd excess = cells.excess.cwiseMax(0.0);
  const double wanted = kHeldShare * excess.sum();
  if (!(wanted > 0.0)) return std::nullopt;
  const Index count = excess.size();
  Stretch best{0, count - 1};
  double most = 0.0;
  double held = 0.0;
  for (Index first = 0, end = 0; first < count; held -= excess[first++]) {
    while (end < count && held < wanted) held += excess[end++];
    if (held < wanted) break;
    const Index longer = (end - 1 - first) - (best.second - best.first);
    if (longer > 0 || (longer == 0 && held <= most)) continue;
    best = {first, end - 1};
    most = held;
  }
  const Index length = best.second - best.first + 1;
  const double usual = excess.segment(best.first, length).sum() /
                       std::max(1.0, cells.rows.segment(best.first, length).sum());
  const auto belongs = [&](Index cell) {
    return cells.rows[cell] > 0.0 && excess[cell] >= kReachesOn * usual * cells.rows[cell];
  };
  while (best.first > 0 && belongs(best.first - 1)) --best.first;
  while (best.second + 1 < count && belongs(best.second + 1)) ++best.second;
  return best;
}

std::vector<Interval> positions_of(const ChannelRows& at, const VectorXd& squares) {
  const double low = at.position_ji.minCoeff();
  const double width = (at.position_ji.maxCoeff() - low) / kPositionCells;
  if (!(width > 0.0)) return {};
  Cells cells(kPositionCells);
  for (Index i = 0; i < at.rows(); ++i) {
    const auto cell = static_cast<Index>((at.position_ji[i] - low) / width);
    cells.add(std::min<Index>(kPositionCells - 1, cell), squares[i]);
  }
  const auto found = stretch_of(cells);
  if (!found) return {};
  return {{low + static_cast<double>(found->first) * width,
           low + static_cast<double>(found->second + 1) * width}};
}

/// In whole blocks of one recording, whose rows are [first, end).
std::optional<Interval> time_of(const ChannelRows& at, const VectorXd& squares, Index first,
                                Index end) {
  const auto block = [&](Index i) { return at.blocks[static_cast<std::size_t>(i)]; };
  Cells cells(block(end - 1) - block(first) + 1);
  VectorXd begins = VectorXd::Constant(cells.rows.size(), at.t_s[end - 1]);
  VectorXd ends = VectorXd::Constant(cells.rows.size(), at.t_s[first]);
  for (Index i = first; i < end; ++i) {
    const Index cell = block(i) - block(first);
    cells.add(cell, squares[i]);
    begins[cell] = std::min(begins[cell], at.t_s[i]);
    ends[cell] = std::max(ends[cell], at.t_s[i]);
  }
  const auto found = stretch_of(cells);
  if (!found) return std::nullopt;
  return Interval{begins[found->first], ends[found->second]};
}

std::vector<Interval> times_of(const ChannelRows& at, const Excess& excess) {
  std::vector<Interval> out;
  for (Index first = 0, end = 0; first < at.rows(); first = end) {
    const auto recording = [&](Index i) { return at.recordings[static_cast<std::size_t>(i)]; };
    while (end < at.rows() && recording(end) == recording(first)) ++end;
    if (excess.squares.segment(first, end - first).mean() < kLeastOfRecording * excess.mean)
      continue;
    if (const auto found = time_of(at, excess.squares, first, end)) out.push_back(*found);
  }
  return out;
}

bool holds_more(const ChannelRows& at, const Excess& excess, const std::vector<char>& in) {
  VectorXd sums = VectorXd::Zero(at.rows() > 0 ? at.blocks.back() + 1 : 0);
  double sum = 0.0;
  Index rows = 0;
  for (Index i = 0; i < at.rows(); ++i) {
    if (in[static_cast<std::size_t>(i)] == 0) continue;
    sums[at.blocks[static_cast<std::size_t>(i)]] += excess.squares[i] - excess.mean;
    sum += excess.squares[i];
    ++rows;
  }
  if (rows < kFewestInRegime) return false;
  return sum > kMoreThanShare * excess.mean * static_cast<double>(rows) &&
         sums.sum() > kClear_z * sums.norm();
}

std::vector<std::string> regimes_of(const ChannelRows& at, const Excess& excess) {
  std::vector<std::string> out;
  const auto look = [&](const std::string& name, const VectorXd& value, double from, double to) {
    std::vector<char> in;
    for (const double v : value) in.push_back(v >= from && v <= to ? 1 : 0);
    if (holds_more(at, excess, in)) out.push_back(name);
  };
  constexpr double kEnd = std::numeric_limits<double>::infinity();
  constexpr double kThird = 1.0 / 3.0;
  const auto look_at_thirds = [&](const std::string& name, const VectorXd& value) {
    if (value.size() == 0) return;
    look(name + ": low third", value, -kEnd, core::upper_quantile(value, kThird));
    look(name + ": high third", value, core::upper_quantile(value, 2.0 * kThird), kEnd);
  };
  const VectorXd direction = at.speed_ji_per_s.cwiseSign();
  look("direction: negative", direction, -1.0, -1.0);
  look("direction: positive", direction, 1.0, 1.0);
  look_at_thirds("speed", at.speed_ji_per_s.cwiseAbs());
  look_at_thirds("load", at.load_ji);
  if (out.empty()) out.emplace_back("everywhere");
  return out;
}

/// What was found in one channel.
struct Found {
  bool any = false;
  bool beyond_plants = false;
  double p_value = std::numeric_limits<double>::quiet_NaN();  ///< what has no name has no chance
};

Found found_in(const View& view, const Channel& channel, const Report& report) {
  Found out;
  for (const NamedEffect& effect : report.effects) {
    if (!stands_in(view, channel, effect)) continue;
    out.any = true;
    out.beyond_plants = out.beyond_plants || effect.beyond_plants;
    out.p_value = std::fmin(out.p_value, effect.p_value);
  }
  for (const Unexplained& unexplained : report.unexplained) {
    if (stands_in(view, channel, unexplained)) out.any = out.beyond_plants = true;
  }
  return out;
}

}  // namespace

void add_mismatch(const View& view, Report& report) {
  const std::vector<ByRecording> loads = transmitted_loads(view);
  for (std::size_t c = 0; c < view.rows.channels().size(); ++c) {
    const Channel& channel = view.rows.channels()[c];
    const Found found = found_in(view, channel, report);
    const ChannelRows at = channel_rows(view, c, loads);
    if (!found.any || at.rows() == 0) continue;
    const Excess excess = excess_of(channel, view, c, found.beyond_plants);
    Mismatch mismatch;
    mismatch.joint = view.given.joints[channel.joint].name;
    mismatch.stage = stage_of(channel);
    mismatch.unit = unit_of(channel, view.given);
    mismatch.excess_rmse = std::sqrt(excess.mean);
    mismatch.floor = excess.floor;
    mismatch.p_value = found.p_value;
    mismatch.regime = regimes_of(at, excess);
    mismatch.position = positions_of(at, excess.squares);
    mismatch.interval_s = times_of(at, excess);
    report.mismatch.push_back(std::move(mismatch));
  }
}

}  // namespace ravencal::diagnose
