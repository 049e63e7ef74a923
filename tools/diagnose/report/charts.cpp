// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/charts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/units.hpp"
#include "report/study_charts.hpp"
#include "report/vega_spec.hpp"

namespace ravencal::diagnose {
namespace {

using ChartJson = nlohmann::json;
using report::Extent;
using Values = std::vector<double>;

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
constexpr const char* kWorseColour = "var(--worse)";

Values scaled(const Values& x, double factor) {
  Values out = x;
  for (double& v : out) v *= factor;
  return out;
}

Values difference(const Values& a, const Values& b) {
  Values out = a;
  for (std::size_t i = 0; i < out.size(); ++i) out[i] -= b[i];
  return out;
}

Values sum(const Values& a, const Values& b) {
  Values out = a;
  for (std::size_t i = 0; i < out.size() && i < b.size(); ++i) out[i] += b[i];
  return out;
}

/// From the least to the greatest finite value, without the outermost `share` on either side,
/// widened by 4 %; never empty.
Extent extent_of(Values values, double share = 0.0) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return {-1.0, 1.0};
  std::sort(values.begin(), values.end());
  const auto cut = static_cast<std::size_t>(share * static_cast<double>(values.size()));
  const Extent e{values[cut], values[values.size() - 1 - cut]};
  double margin = 0.04 * (e.to - e.from);
  if (!(margin > 0.0)) margin = e.to != 0.0 ? 0.1 * std::abs(e.to) : 1.0;
  return {e.from - margin, e.to + margin};
}

Extent joined(const Extent& a, const Extent& b) {
  return {std::min(a.from, b.from), std::max(a.to, b.to)};
}

// ------------------------------------------------------------------ traces

constexpr double kTraceWidth = 590, kTraceHeight = 112, kErrorHeight = 66, kTraceGap = 12;

struct Line {
  std::string name;
  Values values;
  report::LineStyle style;
};

/// Lines of `data` over time, with axes of their own.
ChartJson time_plot(double y, double height, const std::string& y_title,
                    const std::vector<Line>& lines, const Extent& extent, bool last) {
  ChartJson time_axis = report::axis("bottom", "x", last ? "time [s]" : "");
  time_axis["labels"] = last;
  time_axis["ticks"] = last;
  ChartJson y_axis = report::axis("left", "y", y_title);
  y_axis["tickCount"] = 4;
  ChartJson group = report::plot_area(0, y, kTraceWidth, height);
  group["scales"] = ChartJson::array({report::scale("y", "linear", extent, height, 0)});
  group["axes"] = {std::move(time_axis), std::move(y_axis)};
  group["marks"] = ChartJson::array();
  for (const Line& line : lines)
    group["marks"].push_back(report::line_mark("lines", "t", line.name, line.style));
  return group;
}

// ------------------------------------------------------------------ residuals

constexpr double kPanelWidth = 235, kPanelHeight = 150, kPanelStep = kPanelWidth + 70;

struct Axis {
  Values x;
  std::string title;
};

Axis axis_of(const ChannelPlot& plot, Abscissa abscissa) {
  const double factor = display_factor(plot.position_unit);
  const std::string unit = display_unit(plot.position_unit);
  switch (abscissa) {
    case Abscissa::kSpeed:
      return {scaled(plot.speed, factor), fmt::format("speed [{}/s]", unit)};
    case Abscissa::kLoad:
      return {plot.load, fmt::format("effort passed on [{}]", display_unit(plot.load_unit))};
    case Abscissa::kTime:
      return {plot.t_s, "time in its recording [s]"};
    case Abscissa::kPosition:
      break;
  }
  return {scaled(plot.position, factor), fmt::format("position [{}]", unit)};
}

ChartJson points_mark(const std::string& data, const char* colour) {
  const ChartJson shape = {{"signal", "datum.direction < 0 ? 'triangle-left' : 'circle'"}};
  return {{"type", "symbol"},
          {"from", {{"data", data}}},
          {"clip", true},
          {"interactive", false},
          {"encode",
           {{"enter",
             {{"x", {{"scale", "x"}, {"field", "x"}}},
              {"y", {{"scale", "y"}, {"field", "y"}}},
              {"shape", shape},
              {"size", report::value(13)},
              {"opacity", report::value(0.55)},
              {"fill", {{"value", colour}}}}}}}};
}

ChartJson residual_panel(const std::string& data, double x, const char* colour,
                         const std::string& title, const std::string& x_title,
                         const std::string& y_title, const Extent& y) {
  ChartJson group = report::plot_area(x, 18, kPanelWidth, kPanelHeight);
  group["scales"] = {report::scale("y", "linear", y, kPanelHeight, 0)};
  ChartJson x_axis = report::axis("bottom", "x", x_title);
  ChartJson y_axis = report::axis("left", "y", y_title);
  for (ChartJson* one : {&x_axis, &y_axis}) (*one)["tickCount"] = 4;
  group["axes"] = {std::move(x_axis), std::move(y_axis)};
  group["marks"] = {points_mark(data, colour), report::text_mark(0, -9, title)};
  return group;
}

/// Two panels whose axes of error span the same, each about its own middle: a constant error must
/// not hide the shape of the rest.
ChartJson before_and_after(const ChannelPlot& plot, const Axis& axis, const Values& direction,
                           const Values& before, const Values& after) {
  constexpr double kOutermost = 0.005;
  const Extent was = extent_of(before, kOutermost);
  const Extent is = extent_of(after, kOutermost);
  const double half = 0.5 * std::max(was.to - was.from, is.to - is.from);
  const auto about_middle = [half](const Extent& e) {
    const double middle = 0.5 * (e.from + e.to);
    return Extent{middle - half, middle + half};
  };
  ChartJson spec =
      report::chart(fmt::format("{}, {}: error over {}", plot.joint, plot.stage, axis.title),
                    2 * kPanelStep - 60, kPanelHeight + 60);
  spec["data"] = {
      report::columns_data("before", {{"x", axis.x}, {"y", before}, {"direction", direction}}),
      report::columns_data("after", {{"x", axis.x}, {"y", after}, {"direction", direction}})};
  spec["scales"] = {report::scale("x", "linear", extent_of(axis.x), 0, kPanelWidth)};
  const std::string y_title = fmt::format("error [{}]", display_unit(plot.unit));
  spec["marks"] = {residual_panel("before", 0, report::kRawColour, "before", axis.title, y_title,
                                  about_middle(was)),
                   residual_panel("after", kPanelStep, report::kCorrectedColour, "after",
                                  axis.title, "", about_middle(is))};
  return spec;
}

// ------------------------------------------------------------------ intervals

constexpr double kLabelWidth = 150, kIntervalWidth = 170, kRowStep = 22;

ChartJson interval_marks(const IntervalRow& row, double y, const Extent& extent) {
  const auto at = [&](double v) {
    const double share = (v - extent.from) / (extent.to - extent.from);
    return kLabelWidth + kIntervalWidth * std::clamp(share, 0.0, 1.0);
  };
  const char* colour = row.worse ? kWorseColour : report::kCorrectedColour;
  ChartJson marks = ChartJson::array();
  ChartJson label = report::text_mark(kLabelWidth - 10, y, row.label, "right");
  label["encode"]["enter"]["limit"] = report::value(kLabelWidth - 12);
  marks.push_back(std::move(label));
  if (std::isfinite(row.low) && std::isfinite(row.high))
    marks.push_back(report::rule_mark(at(row.low), y, at(row.high), y, colour, 2.5));
  marks.push_back({{"type", "symbol"},
                   {"encode",
                    {{"enter",
                      {{"x", report::value(at(row.value))},
                       {"y", report::value(y)},
                       {"size", report::value(46)},
                       {"fill", {{"value", colour}}}}}}}});
  ChartJson text = report::text_mark(kLabelWidth + kIntervalWidth + 12, y, row.text);
  if (row.worse) text["encode"]["enter"]["fill"] = {{"value", kWorseColour}};
  marks.push_back(std::move(text));
  return marks;
}

Extent extent_of_rows(const std::vector<IntervalRow>& rows, double reference, double most) {
  Values ends = {reference};
  for (const IntervalRow& row : rows) {
    for (const double v : {row.value, row.low, row.high}) {
      if (std::isfinite(v)) ends.push_back(std::clamp(v, -most, most));
    }
  }
  return extent_of(std::move(ends));
}

}  // namespace

double display_factor(std::string_view unit) { return core::display_unit(unit).per_si; }

std::string display_unit(std::string_view unit) {
  return unit == "N_m" ? "N m" : core::display_unit(unit).name;
}

ChartJson trace_chart(const ChannelPlot& plot, const Trace& trace) {
  const double factor = display_factor(plot.unit);
  const std::string unit = display_unit(plot.unit);
  const Values recorded = scaled(sum(trace.measured, trace.motion), factor);
  const Values before = scaled(sum(trace.nominal, trace.motion), factor);
  const Values after = scaled(sum(trace.refitted, trace.motion), factor);
  const std::vector<Line> levels = {
      {"recorded", recorded, {report::kTruthColour, 4.0, "", "linear"}},
      {"before", before, {report::kRawColour, 1.2, "[5,2]", "linear"}},
      {"after", after, {report::kCorrectedColour, 1.2, "", "linear"}}};
  const std::vector<Line> errors = {
      {"was", difference(before, recorded), {report::kRawColour, 1.2, "[5,2]", "linear"}},
      {"is", difference(after, recorded), {report::kCorrectedColour, 1.2, "", "linear"}}};
  report::Columns columns = {{"t", trace.t_s}};
  for (const auto* lines : {&levels, &errors}) {
    for (const Line& line : *lines) columns.emplace_back(line.name, line.values);
  }
  ChartJson spec =
      report::chart(fmt::format("{}, {}: recorded and simulated", plot.joint, plot.stage),
                    kTraceWidth, kTraceHeight + kTraceGap + kErrorHeight);
  spec["data"] = {report::columns_data("lines", columns)};
  spec["scales"] = {report::scale("x", "linear", extent_of(trace.t_s), 0, kTraceWidth)};
  constexpr double kOutermost = 0.002;
  const Extent level_extent =
      joined(extent_of(recorded), joined(extent_of(before, kOutermost), extent_of(after)));
  Extent error_extent =
      joined(extent_of(errors[0].values, kOutermost), extent_of(errors[1].values));
  error_extent = joined(error_extent, {0.0, 0.0});
  const std::string what = trace.motion.empty() ? "effort" : "position";
  ChartJson level_plot =
      time_plot(0, kTraceHeight, fmt::format("{} [{}]", what, unit), levels, level_extent, false);
  ChartJson error_plot = time_plot(kTraceHeight + kTraceGap, kErrorHeight,
                                   fmt::format("error [{}]", unit), errors, error_extent, true);
  error_plot["marks"].insert(error_plot["marks"].begin(), report::zero_rule(kTraceWidth));
  spec["marks"] = {std::move(level_plot), std::move(error_plot)};
  return spec;
}

ChartJson interval_chart(const std::string& description, const std::string& x_title,
                         double reference, double most, const std::vector<IntervalRow>& rows) {
  const double height = kRowStep * static_cast<double>(rows.size());
  const Extent extent = extent_of_rows(rows, reference, most);
  ChartJson spec = report::chart(description, kLabelWidth + kIntervalWidth + 80, height + 44);
  ChartJson area = report::plot_area(kLabelWidth, 0, kIntervalWidth, height);
  area["scales"] = {report::scale("x", "linear", extent, 0, kIntervalWidth)};
  ChartJson x_axis = report::axis("bottom", "x", x_title);
  x_axis["tickCount"] = 4;
  area["axes"] = {std::move(x_axis)};
  const double at = kIntervalWidth * (reference - extent.from) / (extent.to - extent.from);
  area["marks"] = {report::rule_mark(at, 0, at, height, report::kInkColour, 1)};
  spec["marks"] = {std::move(area)};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (ChartJson& mark :
         interval_marks(rows[i], (static_cast<double>(i) + 0.5) * kRowStep, extent))
      spec["marks"].push_back(std::move(mark));
  }
  return spec;
}

ChartJson residual_chart(const ChannelPlot& plot, Abscissa abscissa) {
  const Axis axis = axis_of(plot, abscissa);
  if (axis.x.empty() || axis.x.size() != plot.before.size()) return nullptr;
  const double factor = display_factor(plot.unit);
  return before_and_after(plot, axis, plot.direction, scaled(plot.before, factor),
                          scaled(plot.after, factor));
}

ChartJson rest_chart(const ChannelPlot& plot) {
  constexpr std::size_t kFewestPoints = 20;
  constexpr double kLeastRest_s = 0.05;
  const double factor = display_factor(plot.unit);
  Axis axis{{}, "at rest for [s]"};
  Values direction, before, after;
  for (std::size_t i = 0; i < plot.hold_s.size(); ++i) {
    if (plot.hold_s[i] < kLeastRest_s) continue;
    axis.x.push_back(plot.hold_s[i]);
    direction.push_back(plot.direction[i]);
    before.push_back(factor * plot.before[i]);
    after.push_back(factor * plot.after[i]);
  }
  if (axis.x.size() < kFewestPoints) return nullptr;
  return before_and_after(plot, axis, direction, before, after);
}

ChartJson where_chart(const ChannelPlot& plot) {
  const WhereMap& map = plot.where;
  if (map.before.empty()) return nullptr;
  const double along = display_factor(plot.position_unit);
  const double factor = display_factor(plot.unit);
  const std::string unit = display_unit(plot.position_unit);
  const auto panel = [&](const char* title, const Values& rms) {
    report::WorkspacePanel out{title, 0, {}};
    for (std::size_t c = 0; c < rms.size(); ++c)
      out.cells.push_back({map.rows[c], factor * rms[c], kNoNumber});
    return out;
  };
  report::MapGrid grid;
  grid.x_from = along * map.position_edges.front();
  grid.x_to = along * map.position_edges.back();
  grid.y_from = along * map.speed_edges.front();
  grid.y_to = along * map.speed_edges.back();
  grid.columns = map.position_edges.size() - 1;
  grid.rows = map.speed_edges.size() - 1;
  return report::workspace_chart(
      fmt::format("{}, {}: error over position and speed", plot.joint, plot.stage), grid,
      fmt::format("position [{}]", unit), fmt::format("speed [{}/s]", unit),
      display_unit(plot.unit), {panel("before", map.before), panel("after", map.after)});
}

ChartJson waterfall_chart(const ChannelPlot& plot) {
  const double factor = display_factor(plot.unit);
  std::vector<std::string> labels;
  report::BarPanel panel{"", display_unit(plot.unit), kNoNumber, {}};
  for (const WaterfallStep& step : plot.waterfall) {
    labels.push_back(step.name);
    panel.bars.push_back({factor * step.rms, kNoNumber, kNoNumber, labels.size() == 1});
  }
  return report::bar_chart(fmt::format("{}, {}: error as the model grows", plot.joint, plot.stage),
                           labels, {panel});
}

}  // namespace ravencal::diagnose
