// SPDX-License-Identifier: Apache-2.0
//
// Charts over time: positions above, errors below, one time axis.
#include <utility>

#include <fmt/format.h>

#include "report/charts.hpp"
#include "report/vega_spec.hpp"

namespace ravencal::report {
namespace {

struct TimeLayout {
  double width;
  double position_height;
  double error_height;
  std::size_t bins;  ///< of the envelopes
};
constexpr TimeLayout kWholeLength = {1020, 190, 150, 1020};
constexpr TimeLayout kWindow = {460, 170, 150, 460};
constexpr double kGap = 14;

/// One of the two plots: a group with its own y scale and axes.
json plot_group(double y, double width, double height, Extent extent, const std::string& y_title,
                json marks, bool with_time_labels, const std::string& time_title) {
  json time_axis = axis("bottom", "x", with_time_labels ? time_title : "");
  if (!with_time_labels) {
    time_axis["labels"] = false;
    time_axis["ticks"] = false;
  }
  json y_axis = axis("left", "y", y_title);
  y_axis["tickCount"] = 5;
  json group = plot_area(0, y, width, height);
  group["scales"] = json::array({scale("y", "linear", extent, height, 0)});
  group["axes"] = {std::move(time_axis), std::move(y_axis)};
  group["marks"] = std::move(marks);
  return group;
}

/// Dashed rules where the next recording starts.
json recording_rules(const Timeline& timeline, double height) {
  json rows = json::array();
  for (const double start : timeline.recording_starts) rows.push_back({{"t", start}});
  return {{"type", "rule"},
          {"from", {{"data", "recording_starts"}}},
          {"encode",
           {{"enter",
             {{"x", {{"scale", "x"}, {"field", "t"}}},
              {"y", {{"value", 0}}},
              {"y2", {{"value", height}}},
              {"stroke", {{"value", kInkColour}}},
              {"strokeDash", {{"value", json::array({3, 3})}}}}}}}};
}

json time_chart(const JointView& view, IndexRange range, const TimeLayout& layout,
                bool with_bias_removed, const std::string& description) {
  const auto line = [&](std::span<const double> values) {
    return envelope(view.timeline, values, range, layout.bins);
  };
  const auto truth = line(view.series.truth);
  const auto raw = line(view.series.raw);
  const auto corrected = line(view.series.corrected);
  const auto raw_error = line(view.raw_error);
  const auto bias_error = with_bias_removed ? line(view.bias_removed_error) : std::vector<Point>{};
  const auto corrected_error = line(view.corrected_error);

  json spec = chart(description, layout.width, layout.position_height + kGap + layout.error_height);
  spec["data"] = {
      line_data("truth", truth),           line_data("raw", raw),
      line_data("corrected", corrected),   line_data("raw_error", raw_error),
      line_data("bias_error", bias_error), line_data("corrected_error", corrected_error)};
  json starts = json::array();
  for (const double start : view.timeline.recording_starts) starts.push_back({{"t", start}});
  spec["data"].push_back({{"name", "recording_starts"}, {"values", std::move(starts)}});
  const auto& t = view.timeline.t_s;
  spec["scales"].push_back(
      scale("x", "linear", {t[range.begin], t[range.end - 1]}, 0, layout.width));

  const std::string time_title =
      view.timeline.recording_starts.empty() ? "time [s]" : "time, recordings end to end [s]";
  json positions = {line_mark("truth", "t", "v", {kTruthColour, 4.0, "", "linear"}),
                    line_mark("raw", "t", "v", {kRawColour, 1.2, "[5,2]", "linear"}),
                    line_mark("corrected", "t", "v", {kCorrectedColour, 1.2, "", "linear"})};
  json errors = {zero_rule(layout.width),
                 line_mark("raw_error", "t", "v", {kRawColour, 1.0, "", "linear"})};
  if (with_bias_removed) {
    errors.push_back(line_mark("bias_error", "t", "v", {kBiasColour, 1.2, "[4,2]", "linear"}));
  }
  errors.push_back(line_mark("corrected_error", "t", "v", {kCorrectedColour, 1.2, "", "linear"}));
  if (!with_bias_removed) {
    positions.push_back(recording_rules(view.timeline, layout.position_height));
    errors.push_back(recording_rules(view.timeline, layout.error_height));
  }
  Extent error_extent = extent_of({raw_error, bias_error, corrected_error});
  error_extent.from = std::min(error_extent.from, 0.0);
  error_extent.to = std::max(error_extent.to, 0.0);
  const std::string& unit = view.series.unit;
  spec["marks"] = {
      plot_group(0, layout.width, layout.position_height, extent_of({truth, raw, corrected}),
                 fmt::format("{} [{}]", view.series.joint, unit), std::move(positions), false, ""),
      plot_group(layout.position_height + kGap, layout.width, layout.error_height, error_extent,
                 fmt::format("error [{}]", unit), std::move(errors), true, time_title)};
  return spec;
}

}  // namespace

json trace_chart(const JointView& view) {
  return time_chart(view, {0, view.timeline.t_s.size()}, kWholeLength, false,
                    view.series.joint + ": position and error over the whole length");
}

json window_chart(const JointView& view, IndexRange range, const std::string& description) {
  return time_chart(view, range, kWindow, true, description);
}

}  // namespace ravencal::report
