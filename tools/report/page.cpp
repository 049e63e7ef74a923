// SPDX-License-Identifier: Apache-2.0
#include "report/page.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "report/charts.hpp"
#include "report/document.hpp"
#include "report/escape.hpp"
#include "report/joint_view.hpp"
#include "report/tables.hpp"

namespace ravencal::report {
namespace {

/// Length of the windows shown in detail: 10 s, or in steps of 10 s what holds 200 samples.
double detail_duration_s(const Timeline& timeline) {
  constexpr double kStepS = 10.0;
  constexpr double kLeastSamples = 200;
  return kStepS * std::max(1.0, std::ceil(kLeastSamples * timeline.period_s / kStepS));
}

/// What the colours of a joint's charts mean, with the figures of the drawn samples.
std::string joint_key_html(const JointView& view) {
  const auto with_figures = [&view](const char* name, const std::vector<double>& error) {
    const Summary summary = summary_of(error);
    const int decimals = decimals_for(summary.rmse);
    return fmt::format("<b>{}</b>&ensp;RMSE {}, peak {} {}", name,
                       figure_text(summary.rmse, decimals), figure_text(summary.peak, decimals),
                       html_escape(view.series.unit));
  };
  return "<ul class=\"key\">" + key_item_html("var(--truth)", "none", 4, "<b>true</b>") +
         key_item_html("var(--raw)", "none", 2, with_figures("raw", view.raw_error)) +
         key_item_html("var(--bias)", "4 2", 2,
                       with_figures("bias removed", view.bias_removed_error)) +
         key_item_html("var(--corrected)", "none", 2,
                       with_figures("corrected", view.corrected_error)) +
         "</ul>\n";
}

void add_windows(Document& page, const JointView& view) {
  const double duration_s = detail_duration_s(view.timeline);
  const auto windows = detail_windows(view.timeline, view.corrected_error, duration_s);
  if (!windows) return;
  page.add("<div class=\"pair\">");
  page.figure(window_chart(view, windows->typical, view.series.joint + ": a typical window"),
              fmt::format("Typical {:.0f} s", duration_s),
              "The window whose corrected RMSE is the median of all windows.", false);
  page.figure(window_chart(view, windows->worst, view.series.joint + ": the worst window"),
              fmt::format("Worst {:.0f} s", duration_s),
              "The window around the largest error that is left after correction.", false);
  page.add("</div>\n");
}

void add_map(Document& page, const JointView& view, const MapAxes& axes) {
  const auto resting =
      static_cast<double>(std::count(view.direction.begin(), view.direction.end(), 0));
  const double share = 100 * resting / static_cast<double>(view.direction.size());
  page.figure(
      map_chart(view, axes), "Error over the workspace",
      fmt::format(
          "RMS error by {} and {}, apart for rising and falling {}: friction and slack show as a "
          "difference between the two rows. The first three columns share one colour scale; the "
          "last shows the corrected errors again on their own. Hatched: fewer than {} samples, "
          "untested. Samples at rest or without truth are in neither row ({:.1f} %). Point at a "
          "cell for its "
          "figures.",
          axes.x.joint, axes.y.joint, view.series.joint, kLeastCellSamples, share),
      true);
}

void add_joint(Document& page, const JointSeries& series, std::size_t index,
               const std::optional<MapAxes>& axes) {
  const JointView view = view_of(series);
  page.section(fmt::format("joint-{}", index), series.joint);
  page.add(joint_key_html(view));
  const std::string boundaries =
      view.timeline.recording_starts.empty() ? "" : " Dashed: the next recording begins.";
  page.figure(
      trace_chart(view), "Position and error over time",
      "Error = estimate − truth. Each pixel column shows its least and its greatest sample, so no "
      "peak is lost; a gap is missing data." +
          boundaries,
      true);
  add_windows(page, view);
  page.add("<div class=\"pair\">");
  page.figure(histogram_chart(view), "Errors by size",
              "Every sample is counted. Logarithmic, so that rare large errors are seen.", false);
  page.figure(
      quantile_chart(view), "How often an error is at most so large",
      "Read at 95 %: that share of the samples has a smaller error. Each line ends at its peak.",
      false);
  page.add("</div>\n");
  if (axes) add_map(page, view, *axes);
}

const JointSeries* find_series(const CalibrationReport& report, const std::string& joint) {
  const auto found =
      std::find_if(report.series.begin(), report.series.end(),
                   [&joint](const JointSeries& series) { return series.joint == joint; });
  return found == report.series.end() ? nullptr : &*found;
}

std::optional<MapAxes> map_axes_of(const CalibrationReport& report) {
  const JointSeries* x = find_series(report, report.map_x_joint);
  const JointSeries* y = find_series(report, report.map_y_joint);
  if (x == nullptr || y == nullptr) return std::nullopt;
  const auto grid = grid_over(x->truth, y->truth, kMapCells);
  if (!grid) return std::nullopt;
  return MapAxes{*x, *y, *grid};
}

void add_training(Document& page, const CalibrationReport& report) {
  page.section("training", "Training");
  page.add("<ul class=\"key\">" + key_item_html("var(--corrected)", "none", 2, "<b>training</b>") +
           key_item_html("var(--raw)", "5 2", 2, "<b>validation</b>") + "</ul>\n");
  std::string runs =
      report.losses.size() == 1 ? "One run" : fmt::format("{} runs", report.losses.size());
  page.figure(loss_chart(report.losses, report.loss_unit), "Loss by epoch",
              runs + " on a logarithmic axis. Circle: the epoch whose weights were kept.", true);
}

void add_real_time(Document& page, const RealTimeFigures& figures) {
  page.section("real-time", "Real time");
  page.add(duration_table_html(figures));
  const double period_us = 1e6 / figures.rate_hz;
  page.note(fmt::format("{} ticks at {:g} Hz (period {:g} µs), {} a real-time scheduling class. {}",
                        figures.ticks, figures.rate_hz, period_us,
                        figures.realtime ? "with" : "without", figures.conditions));
  const std::string caption = "Both axes logarithmic. Dashed: the period, where it is in range.";
  page.add("<div class=\"pair\">");
  if (!figures.wakeup_histogram.empty()) {
    page.figure(duration_chart(figures.wakeup_histogram, "wake-up lateness", 1e3 * period_us),
                "Lateness of the wake-up", caption, false);
  }
  if (!figures.step_histogram.empty()) {
    page.figure(duration_chart(figures.step_histogram, "step", 1e3 * period_us), "Time in the step",
                caption, false);
  }
  page.add("</div>\n");
}

}  // namespace

std::string page_of(const CalibrationReport& report) {
  Document page;
  if (!report.tables.empty()) page.section("figures", "Errors at the joint");
  for (const ErrorTable& table : report.tables) page.add(error_table_html(table));
  const std::optional<MapAxes> axes = map_axes_of(report);
  for (std::size_t i = 0; i < report.series.size(); ++i) add_joint(page, report.series[i], i, axes);
  if (!report.losses.empty()) add_training(page, report);
  if (report.real_time) add_real_time(page, *report.real_time);
  page.provenance(report.provenance, report.reproduce);
  return page.html({report.title, report.subtitle, report.verdict});
}

}  // namespace ravencal::report
