// SPDX-License-Identifier: Apache-2.0
//
// What the page draws of a channel: residuals before and after over everything that tells
// look-alikes apart, a map of where they are, what each part of the model takes away, and stretches
// that no fit saw.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "diagnose/channel/channel.hpp"
#include "diagnose/channel/homings.hpp"
#include "diagnose/effects/shapes.hpp"
#include "diagnose/selection/invariance.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kPoints = 400;
constexpr std::size_t kPositions = 10;
constexpr std::size_t kSpeeds = 6;
constexpr int kLeastInCell = 20;
constexpr Index kTraceRows = 400;
constexpr double kTrace_s = 20.0;
constexpr std::size_t kMostTraces = 3;

/// Time since the joint came to rest, 0 in motion.
VectorXd time_at_rest(const Series& s) {
  const double least = rest_speed(s);
  VectorXd held = VectorXd::Zero(s.rows());
  for (Index i = 1; i < s.rows(); ++i) {
    const bool rests = std::abs(s.motion.v[i]) < least && s.fresh[static_cast<std::size_t>(i)] == 0;
    held[i] = rests ? held[i - 1] + s.t_s[i] - s.t_s[i - 1] : 0.0;
  }
  return held;
}

const VectorXd& load_of(const Series& s) {
  if (s.transmitted.size() > 0 && s.transmitted.cwiseAbs().maxCoeff() > 0.0) return s.transmitted;
  return s.loads.empty() ? s.weight : s.loads.front().value;
}

void add_points(const Series& s, const VectorXd& before, const VectorXd& after, ChannelPlot& plot) {
  const VectorXd held = time_at_rest(s);
  const VectorXd& load = load_of(s);
  const Index stride = std::max<Index>(1, s.rows() / kPoints);
  for (Index i = 0; i < s.rows(); i += stride) {
    if (s.valid[static_cast<std::size_t>(i)] == 0) continue;
    plot.t_s.push_back(s.t_s[i]);
    plot.position.push_back(s.motion.q[i]);
    plot.direction.push_back(s.motion.v[i] < 0.0 ? -1.0 : 1.0);
    plot.speed.push_back(s.motion.v[i]);
    plot.hold_s.push_back(held[i]);
    if (load.size() > 0) plot.load.push_back(load[i]);
    plot.before.push_back(before[i]);
    plot.after.push_back(after[i]);
  }
}

std::vector<double> even_edges(double from, double to, std::size_t cells) {
  std::vector<double> edges;
  for (std::size_t k = 0; k <= cells; ++k)
    edges.push_back(from + (to - from) * static_cast<double>(k) / static_cast<double>(cells));
  return edges;
}

/// Cell of a value; outliers belong to the outermost.
std::size_t cell_of(const std::vector<double>& edges, double value) {
  const auto it = std::upper_bound(edges.begin() + 1, edges.end() - 1, value);
  return static_cast<std::size_t>(it - edges.begin()) - 1;
}

WhereMap where_map(const Series& s, const VectorXd& before, const VectorXd& after) {
  WhereMap map;
  const auto [least, greatest] = s.training_range(s.motion.q);
  const double fast = 2.0 * s.training_rms(s.motion.v);
  if (!(greatest > least) || !(fast > 0.0)) return map;
  map.position_edges = even_edges(least, greatest, kPositions);
  map.speed_edges = even_edges(-fast, fast, kSpeeds);
  std::vector<double> count(kPositions * kSpeeds, 0.0);
  map.before.assign(count.size(), 0.0);
  map.after.assign(count.size(), 0.0);
  for (Index i = 0; i < s.rows(); ++i) {
    if (s.valid[static_cast<std::size_t>(i)] == 0) continue;
    const std::size_t cell = cell_of(map.speed_edges, s.motion.v[i]) * kPositions +
                             cell_of(map.position_edges, s.motion.q[i]);
    count[cell] += 1.0;
    map.before[cell] += before[i] * before[i];
    map.after[cell] += after[i] * after[i];
  }
  for (std::size_t c = 0; c < count.size(); ++c) {
    map.rows.push_back(static_cast<std::size_t>(count[c]));
    const bool enough = count[c] >= kLeastInCell;
    const double none = std::numeric_limits<double>::quiet_NaN();
    map.before[c] = enough ? std::sqrt(map.before[c] / count[c]) : none;
    map.after[c] = enough ? std::sqrt(map.after[c] / count[c]) : none;
  }
  return map;
}

double rms(const VectorXd& x) {
  return x.size() > 0 ? std::sqrt(x.squaredNorm() / static_cast<double>(x.size())) : 0.0;
}

/// Cross-validated RMS as the model grows: plant, its numbers refitted, each effect, floor.
std::vector<WaterfallStep> waterfall(const ChannelFit& fit) {
  const ChannelModel& model = fit.model;
  const Series& s = *model.series;
  std::vector<WaterfallStep> steps = {
      {"plant as it is", rms(model.blocks.gather(error_of_plant(fit)))},
      {"its numbers refitted", rms(fit.base_residual)}};
  const MatrixXd columns = model.columns();
  const auto left_by_first = [&](Index width) {
    const MatrixXd some = columns.leftCols(width);
    return rms(held_out_residual(model.blocks, moments_of(model.blocks, some, model.target),
                                 model.column_precision(columns.cols()).head(width), some,
                                 model.target));
  };
  Index width = model.base.cols();
  if (s.payload_effort.size() > 0) steps.push_back({"payload of the arm", left_by_first(width)});
  for (std::size_t i = 0; i < model.chosen.size(); ++i) {
    const Chosen& chosen = model.chosen[i];
    width += chosen.columns.cols();
    const bool kept = i + fit.kept >= model.chosen.size();
    steps.push_back({model.candidates[chosen.candidate]->form->key() + (kept ? " (kept)" : ""),
                     left_by_first(width)});
  }
  steps.push_back({"floor", model.floor});
  return steps;
}

std::vector<RegimeScale> regime_scales(const ChannelFit& fit) {
  std::vector<RegimeScale> scales;
  for (std::size_t i = 0; i + fit.kept < fit.model.chosen.size(); ++i) {
    const std::string name = fit.model.candidates[fit.model.chosen[i].candidate]->form->key();
    for (const SplitScale& split : invariance_of(fit.model, fit.coefficients, i).scales)
      scales.push_back({name, split.regime, split.scale, split.error});
  }
  return scales;
}

/// Rows to step over so that a trace spans its time with its rows.
Index trace_stride(const Series& s, const std::vector<Index>& rows) {
  if (rows.size() < 2) return 1;
  const auto middle = rows.size() / 2;
  const double step_s = s.t_s[rows[middle]] - s.t_s[rows[middle - 1]];
  const double wanted = kTrace_s / (static_cast<double>(kTraceRows) * std::max(step_s, 1e-6));
  const auto most = static_cast<double>(rows.size() / static_cast<std::size_t>(kTraceRows));
  return std::max<Index>(1, static_cast<Index>(std::min(wanted, most)));
}

/// Rows that no fit saw, or the training rows under folds, with their places among those.
struct UnseenRows {
  bool cross_validated = false;
  std::vector<Index> rows, places;
};

/// Of each recording apart.
std::map<int, UnseenRows> unseen_rows(const ChannelFit& fit) {
  const Series& s = *fit.model.series;
  std::map<int, UnseenRows> unseen;
  const auto add = [&](Index row, Index place) {
    UnseenRows& of = unseen[s.recording[static_cast<std::size_t>(row)]];
    of.cross_validated = place >= 0;
    of.rows.push_back(row);
    of.places.push_back(place);
  };
  if (!s.any_held_out()) {
    for (std::size_t k = 0; k < fit.model.blocks.rows.size(); ++k)
      add(fit.model.blocks.rows[k], static_cast<Index>(k));
    return unseen;
  }
  for (Index i = 0; i < s.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    if (s.held_out[n] != 0 && s.valid[n] != 0) add(i, -1);
  }
  return unseen;
}

/// A stretch in the middle of those rows.
Trace trace_of(const ChannelFit& fit, const VectorXd& before, const VectorXd& after,
               const UnseenRows& unseen) {
  const Series& s = *fit.model.series;
  Trace trace;
  trace.cross_validated = unseen.cross_validated;
  trace.recording =
      static_cast<std::size_t>(s.recording[static_cast<std::size_t>(unseen.rows.front())]);
  const auto count = static_cast<Index>(unseen.rows.size());
  const Index stride = trace_stride(s, unseen.rows);
  const Index first = std::max<Index>(0, (count - stride * kTraceRows) / 2);
  const double gap = std::numeric_limits<double>::quiet_NaN();
  const bool of_position = s.stage != Stage::kDrive;
  const auto row_at = [&](Index k) { return unseen.rows[static_cast<std::size_t>(k)]; };
  const auto add = [&](double t_s, double measured, double nominal, double refitted, double q) {
    trace.t_s.push_back(t_s);
    trace.measured.push_back(measured);
    trace.nominal.push_back(nominal);
    trace.refitted.push_back(refitted);
    if (of_position) trace.motion.push_back(q);
  };
  for (Index k = first; k < std::min(count, first + stride * kTraceRows); k += stride) {
    const Index i = row_at(k);
    // Nothing was measured between two episodes: no line leads from one to the next.
    const Index last = k > first ? row_at(k - stride) : i;
    const auto begins = s.fresh.begin();
    if (std::any_of(begins + last + 1, begins + i + 1, [](char fresh) { return fresh != 0; }))
      add(gap, gap, gap, gap, gap);
    const Index place = unseen.places[static_cast<std::size_t>(k)];
    const double nominal = fit.nominal->prediction[i];
    const double measured = nominal + before[i];
    const double left = place >= 0 ? fit.held_out_residual[place] : after[i];
    add(s.t_s[i], measured, nominal, measured - left, s.motion.q[i]);
  }
  return trace;
}

std::vector<Trace> traces_of(const ChannelFit& fit, const VectorXd& before, const VectorXd& after) {
  std::vector<Trace> traces;
  for (const auto& [recording, unseen] : unseen_rows(fit)) {
    if (traces.size() < kMostTraces) traces.push_back(trace_of(fit, before, after, unseen));
  }
  return traces;
}

}  // namespace

void add_plot(const ChannelFit& fit, ChannelFindings& findings) {
  const Series& s = *fit.model.series;
  ChannelPlot& plot = findings.plot;
  plot.joint = findings.joint;
  plot.stage = stage_word(findings.stage);
  plot.unit = findings.unit;
  plot.position_unit = position_unit(s);
  plot.load_unit = effort_unit(s);
  plot.floor = findings.floor;
  const VectorXd before = error_of_plant(fit);
  const VectorXd after = error_of_findings(fit);
  add_points(s, before, after, plot);
  plot.where = where_map(s, before, after);
  plot.waterfall = waterfall(fit);
  plot.scales = regime_scales(fit);
  plot.traces = traces_of(fit, before, after);
}

}  // namespace ravencal::diagnose
