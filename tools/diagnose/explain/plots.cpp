// SPDX-License-Identifier: Apache-2.0
//
// What the page draws of each drive and position: errors before and after over everything that
// tells look-alikes apart, a map of where they are, what each part of the model takes away, sizes
// by circumstance, and stretches of the recordings.
#include "diagnose/explain/parts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnose/explain/circumstances.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();
constexpr Index kMostPoints = 400;
constexpr std::size_t kMapPositions = 10;
constexpr std::size_t kSpeeds = 6;
/// One row per width of the filter: so many are half a second.
constexpr std::size_t kLeastInCell = 5;
/// Fastest speed of the map, in usual ones; outliers belong to the outermost cells.
constexpr double kFastest = 2.0;
constexpr Index kTraceRows = 400;
constexpr double kTrace_s = 20.0;
constexpr std::size_t kMostTraces = 3;
/// Relative change of a channel's RMS below which a part of the model is of other channels.
constexpr double kOfOtherChannels = 1e-3;

/// One channel of a view.
struct PlottedChannel {
  const View& view;
  std::size_t index;
  const Channel& channel;
  const ChannelRows& at;
  VectorXd before, after;  ///< of its used rows
};

void add_points(const PlottedChannel& plotted, ChannelPlot& plot) {
  const ChannelRows& at = plotted.at;
  const Index stride = std::max<Index>(1, (at.rows() + kMostPoints - 1) / kMostPoints);
  for (Index i = 0; i < at.rows(); i += stride) {
    plot.t_s.push_back(at.t_s[i]);
    plot.position.push_back(at.position_ji[i]);
    plot.speed.push_back(at.speed_ji_per_s[i]);
    plot.hold_s.push_back(at.hold_s[i]);
    if (at.load_ji.size() > 0) plot.load.push_back(at.load_ji[i]);
    plot.before.push_back(plotted.before[i]);
    plot.after.push_back(plotted.after[i]);
  }
}

std::vector<double> even_edges(double from, double to, std::size_t cells) {
  std::vector<double> edges;
  for (std::size_t k = 0; k <= cells; ++k)
    edges.push_back(from + (to - from) * static_cast<double>(k) / static_cast<double>(cells));
  return edges;
}

std::size_t cell_of(const std::vector<double>& edges, double value) {
  const auto it = std::upper_bound(edges.begin() + 1, edges.end() - 1, value);
  return static_cast<std::size_t>(it - edges.begin()) - 1;
}

WhereMap where_map(const PlottedChannel& plotted) {
  WhereMap map;
  const VectorXd& q = plotted.at.position_ji;
  const VectorXd& v = plotted.at.speed_ji_per_s;
  const double fastest = kFastest * std::sqrt(v.squaredNorm() / static_cast<double>(v.size()));
  if (!(q.maxCoeff() > q.minCoeff()) || !(fastest > 0.0)) return map;
  map.position_edges = even_edges(q.minCoeff(), q.maxCoeff(), kMapPositions);
  map.speed_edges = even_edges(-fastest, fastest, kSpeeds);
  map.rows.assign(kMapPositions * kSpeeds, 0);
  map.before.assign(map.rows.size(), 0.0);
  map.after.assign(map.rows.size(), 0.0);
  for (Index i = 0; i < q.size(); ++i) {
    const std::size_t cell =
        cell_of(map.speed_edges, v[i]) * kMapPositions + cell_of(map.position_edges, q[i]);
    ++map.rows[cell];
    map.before[cell] += plotted.before[i] * plotted.before[i];
    map.after[cell] += plotted.after[i] * plotted.after[i];
  }
  for (std::size_t c = 0; c < map.rows.size(); ++c) {
    for (auto* squares : {&map.before, &map.after}) {
      double& square = (*squares)[c];
      square = map.rows[c] >= kLeastInCell ? std::sqrt(square / static_cast<double>(map.rows[c]))
                                           : kNoValue;
    }
  }
  return map;
}

/// Rows whose filter sees nothing that was left out: those of used samples.
std::vector<Index> shown_rows(const Track& track, const NoiseRows& rows) {
  std::vector<Index> out;
  for (Index i = 0; i < track.rows(); ++i)
    if (rows.used[static_cast<std::size_t>(i - i % track.tent_rows)] != 0) out.push_back(i);
  return out;
}

/// Rows to step over so that a trace spans its time with its rows.
Index trace_stride(const Track& track, Index rows) {
  const double wanted = kTrace_s / (static_cast<double>(kTraceRows) * track.period_s);
  const double most = static_cast<double>(rows) / static_cast<double>(kTraceRows);
  return std::max<Index>(1, static_cast<Index>(std::min(wanted, most)));
}

/// A stretch in the middle of one recording.
Trace trace_of(const PlottedChannel& plotted, std::size_t recording,
               const std::vector<Index>& rows) {
  const Track& track = plotted.view.rows.tracks()[recording];
  const bool of_position = plotted.channel.kind == ChannelKind::kPosition;
  const auto count = static_cast<Index>(rows.size());
  const Index stride = trace_stride(track, count);
  const Index first = std::max<Index>(0, (count - stride * kTraceRows) / 2);
  Trace trace;
  trace.fitted = !plotted.view.held_out;
  const auto add = [&](double t_s, double measured, double before, double after, double motion) {
    trace.t_s.push_back(t_s);
    trace.measured.push_back(measured);
    trace.nominal.push_back(measured - before);
    trace.refitted.push_back(measured - after);
    if (of_position) trace.motion.push_back(motion);
  };
  for (Index k = first; k < std::min(count, first + stride * kTraceRows); k += stride) {
    const Index i = rows[static_cast<std::size_t>(k)];
    // No line leads over rows that are not shown.
    if (k > first && i - rows[static_cast<std::size_t>(k - stride)] > stride)
      add(kNoValue, kNoValue, kNoValue, kNoValue, kNoValue);
    const double q = of_position ? track.forced.motors[plotted.channel.joint].q[i] : 0.0;
    add(track.begins_s + track.forced.t_s[i], plotted.channel.measured[recording][i] - q,
        plotted.view.before[plotted.index][recording][i],
        plotted.view.after[plotted.index][recording][i], q);
  }
  return trace;
}

std::vector<Trace> traces_of(const PlottedChannel& plotted, std::size_t first_recording) {
  std::vector<Trace> traces;
  for (std::size_t r = 0; r < plotted.view.rows.tracks().size(); ++r) {
    const std::vector<Index> rows =
        shown_rows(plotted.view.rows.tracks()[r], plotted.channel.rows[r]);
    if (rows.empty() || traces.size() == kMostTraces) continue;
    traces.push_back(trace_of(plotted, r, rows));
    traces.back().recording = first_recording + r;
  }
  return traces;
}

std::string name_of(const NamedEffect& effect) {
  return effect.from.empty() ? effect.id : effect.id + " from " + effect.from;
}

/// What a step of the growth leaves with the effect, and the improved plant without it:
/// [channel][recording].
struct StepLeft {
  const GrowthStep& step;
  std::vector<ByRecording> grown, without;
};

std::vector<WaterfallStep> waterfall(const PlottedChannel& plotted,
                                     const std::vector<ByRecording>& refitted,
                                     const std::vector<StepLeft>& steps) {
  std::vector<WaterfallStep> out = {
      {"plant as it is", rms(plotted.channel, plotted.view.before[plotted.index])},
      {"its numbers refitted", rms(plotted.channel, refitted[plotted.index])}};
  for (const StepLeft& left : steps) {
    const double grown = rms(plotted.channel, left.grown[plotted.index]);
    if (std::abs(grown - out.back().rmse) > kOfOtherChannels * out.back().rmse)
      out.push_back({left.step.id, grown});
  }
  out.push_back({"floor", plotted.channel.floor});
  return out;
}

void add_scales(const PlottedChannel& plotted, const std::vector<StepLeft>& steps, Report& report,
                ChannelPlot& plot) {
  for (NamedEffect& effect : report.effects) {
    if (!stands_in(plotted.view, plotted.channel, effect)) continue;
    for (const StepLeft& left : steps) {
      const GrowthStep& step = left.step;
      if (step.id != effect.id || step.joint != effect.joint || step.from != effect.from) continue;
      const VectorXd contribution =
          used_rows(plotted.channel, left.without[plotted.index]) - plotted.after;
      const std::vector<RegimeScale> scales =
          scales_of(name_of(effect), contribution, plotted.after, plotted.at);
      effect.invariance_spread = spread_of(scales);
      plot.scales.insert(plot.scales.end(), scales.begin(), scales.end());
    }
  }
}

}  // namespace

void add_plots(const View& view, const Growth& growth, std::size_t first_recording,
               Report& report) {
  const auto left_of = [&](const physics::Plant& plant) {
    State state = view.rows.base();
    state.plant = plant;
    return left_by(state, view.rows).residuals;
  };
  const std::vector<ByRecording> refitted = left_of(growth.refitted);
  std::vector<StepLeft> steps;
  for (const GrowthStep& step : growth.steps)
    steps.push_back({step, left_of(step.grown), left_of(step.without)});
  const std::vector<ByRecording> loads = transmitted_loads(view);
  for (std::size_t c = 0; c < view.rows.channels().size(); ++c) {
    const Channel& channel = view.rows.channels()[c];
    const ChannelRows at = channel_rows(view, c, loads);
    if (channel.kind == ChannelKind::kLaw || at.rows() == 0) continue;
    const physics::Joint& joint = view.given.joints[channel.joint];
    const PlottedChannel plotted{view,
                                 c,
                                 channel,
                                 at,
                                 used_rows(channel, view.before[c]),
                                 used_rows(channel, view.after[c])};
    ChannelPlot plot;
    plot.joint = joint.name;
    plot.stage = stage_of(channel);
    plot.unit = unit_of(channel, view.given);
    plot.position_unit = position_unit_of(joint);
    plot.load_unit = effort_unit_of(joint);
    plot.floor = channel.floor;
    add_points(plotted, plot);
    plot.where = where_map(plotted);
    plot.waterfall = waterfall(plotted, refitted, steps);
    add_scales(plotted, steps, report, plot);
    plot.traces = traces_of(plotted, first_recording);
    report.plots.push_back(std::move(plot));
  }
}

}  // namespace ravencal::diagnose
