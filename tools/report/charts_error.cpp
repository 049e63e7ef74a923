// SPDX-License-Identifier: Apache-2.0
//
// Charts of the distribution of errors: by size and over the workspace.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "report/charts.hpp"
#include "report/vega_spec.hpp"

namespace ravencal::report {
namespace {

constexpr double kWidth = 460;
constexpr double kHeight = 210;
constexpr std::size_t kHistogramBins = 101;  // odd: one bin is centred on zero
constexpr std::size_t kQuantilePoints = 200;

/// One of the three estimates that a chart compares.
struct Estimate {
  const char* name;
  const char* title;
  const char* colour;
  const char* dash;
  const std::vector<double>& error;
};

std::array<Estimate, 3> estimates_of(const JointView& view) {
  return {{{"raw", "raw", kRawColour, "", view.raw_error},
           {"bias", "bias removed", kBiasColour, "[4,2]", view.bias_removed_error},
           {"corrected", "corrected", kCorrectedColour, "", view.corrected_error}}};
}

double peak_of(const JointView& view) {
  double peak = 0.0;
  for (const Estimate& estimate : estimates_of(view)) {
    const double own = summary_of(estimate.error).peak;
    if (std::isfinite(own)) peak = std::max(peak, own);
  }
  return peak > 0 ? peak : 1.0;
}

constexpr double kPanelWidth = 16 * kMapCells;
constexpr double kPanelHeight = 11 * kMapCells;
constexpr double kColumnStep = kPanelWidth + 28;
constexpr double kOwnColumn = 3 * kColumnStep + 24;
constexpr double kRowStep = kPanelHeight + 42;
constexpr double kLegendTop = kRowStep + kPanelHeight + 44;

struct Panel {
  std::string data;
  std::string title;
  std::string colour_scale;
  double x, y;
  bool left, bottom;
};

json map_data(const std::string& name, const MapGrid& grid, const std::vector<MapCell>& cells) {
  std::vector<double> column, row, rmse, mean, samples;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].samples < kLeastCellSamples) continue;
    column.push_back(static_cast<double>(i % grid.columns));
    const std::size_t row_index = i / grid.columns;
    row.push_back(static_cast<double>(row_index));
    rmse.push_back(cells[i].rmse);
    mean.push_back(cells[i].mean);
    samples.push_back(static_cast<double>(cells[i].samples));
  }
  return significant_data(name, {{"column", std::move(column)},
                                 {"row", std::move(row)},
                                 {"rmse", std::move(rmse)},
                                 {"mean", std::move(mean)},
                                 {"samples", std::move(samples)}});
}

json map_cells(const Panel& panel, const MapGrid& grid) {
  const double width = kPanelWidth / static_cast<double>(grid.columns);
  const double height = kPanelHeight / static_cast<double>(grid.rows);
  return {{"type", "rect"},
          {"from", {{"data", panel.data}}},
          {"encode",
           {{"enter",
             {{"x", {{"field", "column"}, {"mult", width}}},
              {"width", {{"value", width}}},
              {"y", {{"field", "row"}, {"mult", -height}, {"offset", kPanelHeight - height}}},
              {"height", {{"value", height}}},
              {"fill", {{"scale", panel.colour_scale}, {"field", "rmse"}}},
              {"tooltip",
               {{"signal",
                 "format(datum.rmse, '.3~g') + ' ' + unit + ' RMSE, mean ' + "
                 "format(datum.mean, '+.3~g') + ' ' + unit + ', ' + "
                 "format(datum.samples, 'd') + ' samples'"}}}}}}}};
}

json map_panel(const Panel& panel, const MapAxes& axes) {
  json x_axis =
      axis("bottom", "x", panel.bottom ? fmt::format("{} [{}]", axes.x.joint, axes.x.unit) : "");
  json y_axis =
      axis("left", "y", panel.left ? fmt::format("{} [{}]", axes.y.joint, axes.y.unit) : "");
  for (json* one : {&x_axis, &y_axis}) {
    (*one)["grid"] = false;
    (*one)["tickCount"] = 5;
  }
  x_axis["labels"] = panel.bottom;
  y_axis["labels"] = panel.left;
  json title = {
      {"type", "text"},
      {"encode",
       {{"enter",
         {{"x", {{"value", 0}}}, {"y", {{"value", -6}}}, {"text", {{"value", panel.title}}}}}}}};
  json group = plot_area(panel.x, panel.y, kPanelWidth, kPanelHeight);
  group["encode"]["enter"]["fill"] = {{"value", "url(#untested)"}};
  group["axes"] = {std::move(x_axis), std::move(y_axis)};
  group["marks"] = {map_cells(panel, axes.grid), std::move(title)};
  return group;
}

double greatest_rmse(const std::vector<MapCell>& cells) {
  double greatest = 0.0;
  for (const MapCell& cell : cells) {
    if (cell.samples >= kLeastCellSamples) greatest = std::max(greatest, cell.rmse);
  }
  return greatest;
}

json colour_scale(const char* name, double greatest) {
  return {{"name", name},
          {"type", "linear"},
          {"domain", json::array({0.0, greatest > 0 ? greatest : 1.0})},
          {"range", {{"scheme", "viridis"}}},
          {"clamp", true},
          {"nice", false},
          {"zero", true}};
}

json colour_legend(const char* scale_name, double x, double length, const std::string& title) {
  return {{"fill", scale_name},       {"type", "gradient"},  {"direction", "horizontal"},
          {"orient", "none"},         {"legendX", x},        {"legendY", kLegendTop},
          {"gradientLength", length}, {"tickCount", 3},      {"gradientThickness", 10},
          {"title", title},           {"titleLimit", length}};
}

}  // namespace

json histogram_chart(const JointView& view) {
  json spec = chart(view.series.joint + ": number of samples by error", kWidth, kHeight);
  const double half_width = peak_of(view);
  constexpr double kFoot = 0.5;
  double most = 1.0;
  for (const Estimate& estimate : estimates_of(view)) {
    const Histogram bins = histogram(estimate.error, half_width, kHistogramBins);
    std::vector<double> edges, counts;
    for (std::size_t i = 0; i < bins.counts.size(); ++i) {
      const auto count = static_cast<double>(bins.counts[i]);
      edges.push_back(bins.from + bins.width * static_cast<double>(i));
      // The foot of the axis stands for none: a logarithmic axis has no zero.
      counts.push_back(std::max(count, kFoot));
      most = std::max(most, count);
    }
    edges.push_back(half_width);
    counts.push_back(kFoot);
    spec["data"].push_back(significant_data(
        estimate.name, {{"edge", std::move(edges)}, {"count", std::move(counts)}}));
    spec["marks"].push_back(line_mark(estimate.name, "edge", "count",
                                      {estimate.colour, 1.5, estimate.dash, "step-after"}));
  }
  spec["scales"] = {scale("x", "linear", {-half_width, half_width}, 0, kWidth),
                    scale("y", "log", {kFoot, 1.4 * most}, kHeight, 0)};
  json y_axis =
      axis("left", "y",
           fmt::format("samples per {:.2g} {}", 2 * half_width / kHistogramBins, view.series.unit));
  y_axis["values"] = {1, 10, 100, 1000, 10000, 100000, 1000000, 10000000};
  y_axis["format"] = "~s";
  spec["axes"] = {
      axis("bottom", "x", fmt::format("{} error [{}]", view.series.joint, view.series.unit)),
      std::move(y_axis)};
  return spec;
}

json quantile_chart(const JointView& view) {
  json spec =
      chart(view.series.joint + ": share of samples within a magnitude of error", kWidth, kHeight);
  constexpr double kLeastMagnitude = 1e-12;  // a logarithmic axis has no zero
  double greatest = 0.0;
  double least = std::numeric_limits<double>::infinity();
  for (const Estimate& estimate : estimates_of(view)) {
    const auto quantiles = magnitude_quantiles(estimate.error, kQuantilePoints);
    std::vector<double> magnitudes, shares;
    for (const QuantilePoint& point : quantiles) {
      magnitudes.push_back(std::max(point.magnitude, kLeastMagnitude));
      shares.push_back(point.share);
      greatest = std::max(greatest, point.magnitude);
      if (point.share >= 0.05 && point.magnitude > 0) least = std::min(least, point.magnitude);
    }
    spec["data"].push_back(significant_data(
        estimate.name, {{"magnitude", std::move(magnitudes)}, {"share", std::move(shares)}}));
    spec["marks"].push_back(line_mark(estimate.name, "magnitude", "share",
                                      {estimate.colour, 1.5, estimate.dash, "linear"}));
  }
  if (!(greatest > 0) || !std::isfinite(least)) least = greatest = 1.0;
  least = std::clamp(least, greatest / 1e4, greatest / 10);
  const Extent magnitudes = {least, greatest * 1.05};
  spec["scales"] = {scale("x", "log", magnitudes, 0, kWidth),
                    scale("y", "linear", {0, 1}, kHeight, 0)};
  json y_axis = axis("left", "y", "samples within that error");
  y_axis["format"] = ".0%";
  y_axis["values"] = {0, 0.25, 0.5, 0.75, 0.95};
  y_axis["labelOverlap"] = false;
  json x_axis =
      axis("bottom", "x", fmt::format("|{} error| [{}]", view.series.joint, view.series.unit));
  x_axis["format"] = "~g";
  x_axis["values"] = log_ticks(magnitudes);
  spec["axes"] = {std::move(x_axis), std::move(y_axis)};
  return spec;
}

json map_chart(const JointView& view, const MapAxes& axes) {
  json spec = chart(view.series.joint + ": RMS error over the workspace by direction of motion",
                    kOwnColumn + kPanelWidth, kRowStep + kPanelHeight);
  spec["signals"] = {{{"name", "unit"}, {"value", view.series.unit}}};
  double greatest = 0.0;
  double greatest_corrected = 0.0;
  for (const bool rising : {true, false}) {
    const std::string motion = rising ? "rising" : "falling";
    const double y = rising ? 0.0 : kRowStep;
    double x = 0.0;
    for (const Estimate& estimate : estimates_of(view)) {
      const auto cells = error_map(axes.grid, axes.x.truth, axes.y.truth, estimate.error,
                                   view.direction, rising ? 1 : -1);
      const std::string name = fmt::format("{}_{}", estimate.name, motion);
      const std::string title = fmt::format("{}, {} {}", estimate.title, view.series.joint, motion);
      spec["data"].push_back(map_data(name, axes.grid, cells));
      spec["marks"].push_back(map_panel({name, title, "colour", x, y, x == 0, !rising}, axes));
      greatest = std::max(greatest, greatest_rmse(cells));
      if (&estimate.error == &view.corrected_error) {
        greatest_corrected = std::max(greatest_corrected, greatest_rmse(cells));
      }
      x += kColumnStep;
    }
    const std::string own_title = fmt::format("corrected, {}, own colours", motion);
    spec["marks"].push_back(map_panel(
        {"corrected_" + motion, own_title, "own_colour", kOwnColumn, y, false, !rising}, axes));
  }
  spec["scales"] = {scale("x", "linear", {axes.grid.x_from, axes.grid.x_to}, 0, kPanelWidth),
                    scale("y", "linear", {axes.grid.y_from, axes.grid.y_to}, kPanelHeight, 0),
                    colour_scale("colour", greatest),
                    colour_scale("own_colour", greatest_corrected)};
  spec["legends"] = {colour_legend("colour", 0, 2 * kColumnStep + kPanelWidth,
                                   fmt::format("RMSE of the {} [{}], first three columns",
                                               view.series.joint, view.series.unit)),
                     colour_legend("own_colour", kOwnColumn, kPanelWidth,
                                   fmt::format("RMSE [{}], last column", view.series.unit))};
  return spec;
}

}  // namespace ravencal::report
