// SPDX-License-Identifier: Apache-2.0
//
// How far the given plant and the improved one are from what was recorded.
#include "diagnose/explain/parts.hpp"

#include <cmath>
#include <map>
#include <optional>

#include "core/students_t.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr std::size_t kFewestBlocks95 = 4;

/// Over used rows of a channel.
struct SquareSums {
  double before = 0.0, after = 0.0, signal = 0.0, rows = 0.0;

  void add(const SquareSums& other) {
    before += other.before;
    after += other.after;
    signal += other.signal;
    rows += other.rows;
  }
  [[nodiscard]] double rms(double SquareSums::*part) const { return std::sqrt(this->*part / rows); }
  /// In percent of the signal.
  [[nodiscard]] double percent(double SquareSums::*part) const {
    return 100.0 * std::sqrt(this->*part / signal);
  }
};

using SumsByBlock = std::map<int, SquareSums>;

SquareSums total_of(const SumsByBlock& blocks) {
  SquareSums total;
  for (const auto& [block, sums] : blocks) total.add(sums);
  return total;
}

/// Of the channel's used rows in one recording.
SumsByBlock blocks_of(const Likelihood& rows, const Channel& channel, std::size_t recording,
                      const VectorXd& before, const VectorXd& after, const VectorXd& signal) {
  SumsByBlock blocks;
  Index at = channel.first[recording];
  for (const Index i : channel.used[recording]) {
    const int block = rows.blocks()[static_cast<std::size_t>(at++)];
    blocks[block].add({before[i] * before[i], after[i] * after[i], signal[i] * signal[i], 1.0});
  }
  return blocks;
}

/// 95 % of after / before - 1: the logarithm of the ratio of sums, linearised.
std::optional<Interval> change_interval(const SumsByBlock& blocks) {
  const SquareSums total = total_of(blocks);
  if (blocks.size() < kFewestBlocks95 || !(total.before > 0.0) || !(total.after > 0.0))
    return std::nullopt;
  const auto count = static_cast<double>(blocks.size());
  double square = 0.0;
  for (const auto& [block, sums] : blocks)
    square += std::pow(sums.after / total.after - sums.before / total.before, 2);
  const double quantile = core::students_t_975(count - 1.0);
  // Half of it: the sums are squares.
  const double half = 0.5 * quantile * std::sqrt(square * count / (count - 1.0));
  const double middle = 0.5 * std::log(total.after / total.before);
  return Interval{std::exp(middle - half) - 1.0, std::exp(middle + half) - 1.0};
}

std::string metric_of(const Channel& channel) {
  if (channel.kind == ChannelKind::kDrive) return "effort_rmse";
  return channel.tracking ? "tracking_rmse" : "position_rmse";
}

HeldOut percentage(const std::string& joint, const std::string& metric, const SquareSums& sums,
                   double floor_percent) {
  return {joint,
          metric,
          "%",
          sums.percent(&SquareSums::before),
          sums.percent(&SquareSums::after),
          floor_percent};
}

/// Against the effort as recorded: what the filter takes from recording and prediction counts.
SquareSums unfiltered_sums(const View& view, const Channel& channel) {
  SquareSums total;
  for (std::size_t r = 0; r < view.rows.tracks().size(); ++r) {
    if (channel.used[r].empty()) continue;
    const VectorXd& effort = view.rows.tracks()[r].joints[channel.joint].effort;
    const physics::Predictor& predictor = view.rows.predictor(r);
    const VectorXd before = effort - predictor.predict(view.given).effort[channel.joint];
    const VectorXd after = effort - predictor.predict(view.improved).effort[channel.joint];
    total.add(total_of(blocks_of(view.rows, channel, r, before, after, effort)));
  }
  return total;
}

void add_channel(const View& view, std::size_t c, std::size_t first_recording, Report& report) {
  const Channel& channel = view.rows.channels()[c];
  SumsByBlock blocks;
  HeldOut out;
  for (std::size_t r = 0; r < channel.used.size(); ++r) {
    if (channel.used[r].empty()) continue;
    // Blocks of two recordings have nothing in common.
    SumsByBlock own =
        blocks_of(view.rows, channel, r, view.before[c][r], view.after[c][r], channel.measured[r]);
    const SquareSums sums = total_of(own);
    out.by_recording.push_back(
        {first_recording + r, sums.rms(&SquareSums::before), sums.rms(&SquareSums::after)});
    blocks.merge(own);
  }
  if (blocks.empty()) return;
  const SquareSums total = total_of(blocks);
  out.joint = view.given.joints[channel.joint].name;
  out.metric = metric_of(channel);
  out.unit = unit_of(channel, view.given);
  out.before = total.rms(&SquareSums::before);
  out.after = total.rms(&SquareSums::after);
  out.floor = channel.floor;
  out.change_ci95 = change_interval(blocks);
  out.drawn_constant = view.drawn_constant[c];
  report.held_out.push_back(out);
  if (channel.kind != ChannelKind::kDrive || !(total.signal > 0.0)) return;
  const double floor_percent = 100.0 * channel.floor / total.rms(&SquareSums::signal);
  report.held_out.push_back(percentage(out.joint, "effort_relative_error", total, floor_percent));
  if (!view.held_out) return;
  report.held_out.push_back(percentage(out.joint, "effort_relative_error_unfiltered",
                                       unfiltered_sums(view, channel), floor_percent));
}

}  // namespace

void add_held_out(const View& view, std::size_t first_recording, Report& report) {
  for (std::size_t c = 0; c < view.rows.channels().size(); ++c)
    if (view.rows.channels()[c].kind != ChannelKind::kLaw)
      add_channel(view, c, first_recording, report);
}

}  // namespace ravencal::diagnose
