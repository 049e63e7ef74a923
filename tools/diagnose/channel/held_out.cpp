// SPDX-License-Identifier: Apache-2.0
//
// The channel's error on rows that no fit saw, before and after the findings, with an interval of
// the change and apart for each recording.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "diagnose/channel/channel.hpp"
#include "diagnose/channel/error_left.hpp"
#include "diagnose/channel/homings.hpp"
#include "diagnose/findings/quantiles.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Rows of the residual that resemble each other span one observation.
constexpr double kCorrelationsPerBlock = 5.0;
constexpr std::size_t kFewestBlocks95 = 4;

/// Sums of squares over a stretch of unseen rows of one recording.
struct Squares {
  std::size_t recording = 0;
  double before = 0.0, after = 0.0, signal = 0.0, count = 0.0;

  void add(double was, double is, double value) {
    before += was * was;
    after += is * is;
    signal += value * value;
    count += 1.0;
  }
  void add(const Squares& other) {
    before += other.before;
    after += other.after;
    signal += other.signal;
    count += other.count;
  }
};

Squares sum_of(const std::vector<Squares>& blocks) {
  Squares total;
  for (const Squares& block : blocks) total.add(block);
  return total;
}

std::size_t recording_of(const Series& series, Index row) {
  return static_cast<std::size_t>(series.recording[static_cast<std::size_t>(row)]);
}

/// Held-out rows of `y`, with these errors before and after, in stretches that no recording or
/// episode begins within.
std::vector<Squares> held_out_blocks(const ChannelFit& fit, const VectorXd& y,
                                     const VectorXd& before, const VectorXd& after) {
  const Series& series = *fit.model.series;
  const double most = std::max(1.0, kCorrelationsPerBlock * fit.model.correlation_rows);
  std::vector<Squares> blocks;
  bool open = false;
  for (Index i = 0; i < y.size(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    open = open && series.fresh[n] == 0;
    if (series.held_out[n] == 0 || series.valid[n] == 0) continue;
    open = open && blocks.back().count < most && blocks.back().recording == recording_of(series, i);
    if (!open) {
      blocks.emplace_back();
      blocks.back().recording = recording_of(series, i);
      open = true;
    }
    blocks.back().add(before[i], after[i], y[i]);
  }
  return blocks;
}

/// Training rows, each under a fit without its fold.
std::vector<Squares> cross_validated_blocks(const ChannelFit& fit, const VectorXd& before) {
  const Series& series = *fit.model.series;
  const Blocks& blocks = fit.model.blocks;
  std::vector<Squares> out(blocks.count());
  for (std::size_t b = 0; b < blocks.count(); ++b) {
    for (Index k = blocks.first(b); k < blocks.first(b) + blocks.size(b); ++k) {
      const Index row = blocks.rows[static_cast<std::size_t>(k)];
      out[b].recording = recording_of(series, row);
      out[b].add(before[row], fit.held_out_residual[k], series.y[row]);
    }
  }
  return out;
}

/// 95 % of after / before - 1 by linearising the logarithm of the ratio of sums; quantile of
/// Student's t by the first term of its expansion about the normal's.
std::optional<Interval> change_interval(const std::vector<Squares>& blocks) {
  const Squares total = sum_of(blocks);
  if (blocks.size() < kFewestBlocks95 || !(total.before > 0.0) || !(total.after > 0.0))
    return std::nullopt;
  const auto count = static_cast<double>(blocks.size());
  double square = 0.0;
  for (const Squares& b : blocks)
    square += std::pow(b.after / total.after - b.before / total.before, 2);
  const double quantile = kNormal95 + (std::pow(kNormal95, 3) + kNormal95) / (4.0 * (count - 1.0));
  // Half of it: the sums are squares.
  const double half = 0.5 * quantile * std::sqrt(square * count / (count - 1.0));
  const double middle = 0.5 * std::log(total.after / total.before);
  return Interval{std::exp(middle - half) - 1.0, std::exp(middle + half) - 1.0};
}

std::vector<RecordingFigure> by_recording(const std::vector<Squares>& blocks) {
  std::map<std::size_t, Squares> sums;
  for (const Squares& block : blocks) sums[block.recording].add(block);
  std::vector<RecordingFigure> figures;
  for (const auto& [recording, sum] : sums) {
    figures.push_back(
        {recording, std::sqrt(sum.before / sum.count), std::sqrt(sum.after / sum.count)});
  }
  return figures;
}

/// RMS of what the plant's homings draw, at the valid rows.
std::optional<double> drawn_constant(const ChannelFit& fit, const VectorXd& before) {
  const Series& series = *fit.model.series;
  if (!series.homing_draws) return std::nullopt;
  double sum = 0.0, count = 0.0;
  for (Index i = 0; i < series.rows(); ++i) {
    if (series.valid[static_cast<std::size_t>(i)] == 0) continue;
    sum += std::pow(series.y[i] - fit.nominal->prediction[i] - before[i], 2);
    count += 1.0;
  }
  return std::sqrt(sum / std::max(1.0, count));
}

std::string metric_of(Stage stage) {
  if (stage == Stage::kDrive) return "effort_rmse";
  return stage == Stage::kTracking ? "tracking_rmse" : "position_rmse";
}

/// In percent of the effort: as filtered like the motion and, where rows are held out, as recorded,
/// noise above the motion's band included.
void add_relative(const ChannelFit& fit, const Squares& total, ChannelFindings& findings) {
  const Series& series = *fit.model.series;
  if (series.stage != Stage::kDrive || !(total.signal > 0.0)) return;
  const auto percent = [](double part, double whole) { return 100.0 * std::sqrt(part / whole); };
  const double floor = 100.0 * findings.floor / std::sqrt(total.signal / total.count);
  findings.held_out.push_back({findings.joint, "effort_relative_error", "%",
                               percent(total.before, total.signal),
                               percent(total.after, total.signal), floor});
  const Squares recorded =
      sum_of(held_out_blocks(fit, series.recorded, series.recorded - fit.nominal->prediction,
                             series.recorded - fit.prediction));
  if (!(recorded.signal > 0.0)) return;
  findings.held_out.push_back({findings.joint, "effort_relative_error_unfiltered", "%",
                               percent(recorded.before, recorded.signal),
                               percent(recorded.after, recorded.signal), floor});
}

}  // namespace

void add_held_out(const ChannelFit& fit, ChannelFindings& findings) {
  const Series& series = *fit.model.series;
  const VectorXd before = error_of_plant(fit);
  const std::vector<Squares> blocks =
      series.any_held_out() ? held_out_blocks(fit, series.y, before, error_of_findings(fit))
                            : cross_validated_blocks(fit, before);
  const Squares total = sum_of(blocks);
  if (total.count == 0.0) return;
  findings.held_out.push_back(
      {findings.joint, metric_of(series.stage), findings.unit,
       std::sqrt(total.before / total.count), std::sqrt(total.after / total.count), findings.floor,
       change_interval(blocks), by_recording(blocks), drawn_constant(fit, before)});
  add_relative(fit, total, findings);
  // Placebos are asked for names only.
  if (findings.placebo) add_error_left(fit, findings);
}

}  // namespace ravencal::diagnose
