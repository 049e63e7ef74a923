// SPDX-License-Identifier: Apache-2.0
#include "report/study_charts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "report/charts.hpp"
#include "report/vega_spec.hpp"

namespace ravencal::report {
namespace {

/// Okabe and Ito, "Color Universal Design" (2008), but black and yellow.
constexpr std::array kLineColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                     "#e69f00", "#56b4e9", "#808890"};

/// A chart that draw.js makes: its function and arguments, null for what is not finite.
json drawn_by(const char* function, json arguments) {
  return {{"draw", function}, {"arguments", std::move(arguments)}};
}

// ------------------------------------------------------------------ lines over settings

constexpr double kLinePanelWidth = 270;
constexpr double kLinePanelHeight = 230;
constexpr double kLinePanelStep = kLinePanelWidth + 66;

Extent positive_extent(const SettingPanel& panel) {
  double least = kUnknown;
  double greatest = kUnknown;
  for (const SettingLine& line : panel.lines) {
    for (const auto* values : {&line.values, &line.low, &line.high}) {
      for (const double one : *values) {
        if (!std::isfinite(one) || one <= 0.0) continue;
        least = std::fmin(least, one);
        greatest = std::fmax(greatest, one);
      }
    }
  }
  constexpr double kMargin = 1.15;
  return std::isfinite(least) ? Extent{least / kMargin, greatest * kMargin} : Extent{0.1, 10.0};
}

json setting_data(const std::string& name, const SettingLine& line) {
  json rows = json::array();
  for (std::size_t i = 0; i < line.values.size(); ++i) {
    if (!std::isfinite(line.values[i]) || line.values[i] <= 0.0) continue;
    rows.push_back({{"setting", i},
                    {"value", line.values[i]},
                    {"low", line.low[i]},
                    {"high", line.high[i]},
                    {"text", fmt::format("{}, {}: {:.4g}", line.name, i, line.values[i])}});
  }
  return {{"name", name}, {"values", std::move(rows)}};
}

json coordinate(const char* axis_scale, const char* field) {
  return {{"scale", axis_scale}, {"field", field}};
}

void add_setting_line(const std::string& data, const char* colour, json& marks) {
  marks.push_back(line_mark(data, "setting", "value", {colour, 1.6, "", "linear"}));
  marks.push_back({{"type", "rule"},
                   {"from", {{"data", data}}},
                   {"encode",
                    {{"enter",
                      {{"x", coordinate("x", "setting")},
                       {"y", coordinate("y", "low")},
                       {"y2", coordinate("y", "high")},
                       {"stroke", {{"value", colour}}},
                       {"strokeWidth", value(1)}}}}}});
  marks.push_back({{"type", "symbol"},
                   {"from", {{"data", data}}},
                   {"encode",
                    {{"enter",
                      {{"x", coordinate("x", "setting")},
                       {"y", coordinate("y", "value")},
                       {"size", value(40)},
                       {"fill", {{"value", colour}}},
                       {"tooltip", {{"field", "text"}}}}}}}});
}

}  // namespace

json bar_chart(const std::string& description, const std::vector<std::string>& labels,
               const std::vector<BarPanel>& panels) {
  json list = json::array();
  for (const BarPanel& panel : panels) {
    json bars = json::array();
    for (const Bar& bar : panel.bars) {
      bars.push_back(
          {{"value", bar.value}, {"low", bar.low}, {"high", bar.high}, {"marked", bar.marked}});
    }
    list.push_back({{"title", panel.title},
                    {"unit", panel.unit},
                    {"reference", panel.reference},
                    {"bars", std::move(bars)}});
  }
  return drawn_by("bar_chart", json::array({description, labels, std::move(list)}));
}

json setting_chart(const std::string& description, const std::string& setting_title,
                   const std::vector<SettingPanel>& panels) {
  json spec = chart(description, kLinePanelStep * static_cast<double>(panels.size()),
                    kLinePanelHeight + 60);
  std::vector<std::string> names;
  double x = 0.0;
  for (std::size_t p = 0; p < panels.size(); ++p) {
    const SettingPanel& panel = panels[p];
    json group = plot_area(x, 18, kLinePanelWidth, kLinePanelHeight);
    const Extent extent = positive_extent(panel);
    json marks = json::array({text_mark(0, -10, panel.title)});
    std::size_t settings = 1;
    names.clear();
    for (std::size_t i = 0; i < panel.lines.size() && i < kLineColours.size(); ++i) {
      const std::string data = fmt::format("line_{}_{}", p, i);
      spec["data"].push_back(setting_data(data, panel.lines[i]));
      add_setting_line(data, kLineColours[i], marks);
      settings = std::max(settings, panel.lines[i].values.size());
      names.push_back(panel.lines[i].name);
    }
    group["scales"] = {
        scale("x", "linear", {-0.3, static_cast<double>(settings) - 0.7}, 0, kLinePanelWidth),
        scale("y", "log", extent, kLinePanelHeight, 0)};
    json x_axis = axis("bottom", "x", setting_title);
    x_axis["format"] = "d";
    x_axis["values"] = json::array();
    for (std::size_t i = 0; i < settings; ++i) x_axis["values"].push_back(i);
    json y_axis = axis("left", "y", fmt::format("RMSE [{}]", panel.unit));
    y_axis["values"] = log_ticks(extent);
    y_axis["format"] = "~g";
    group["axes"] = {std::move(x_axis), std::move(y_axis)};
    group["marks"] = std::move(marks);
    spec["marks"].push_back(std::move(group));
    x += kLinePanelStep;
  }
  json colours = json::array();
  for (std::size_t i = 0; i < names.size(); ++i) colours.push_back(kLineColours[i]);
  spec["scales"].push_back(
      {{"name", "line"}, {"type", "ordinal"}, {"domain", names}, {"range", std::move(colours)}});
  spec["legends"] = {{{"fill", "line"},
                      {"orient", "bottom"},
                      {"symbolType", "circle"},
                      {"columns", 3},
                      {"labelLimit", 320}}};
  return spec;
}

json workspace_chart(const std::string& description, const MapGrid& grid,
                     const std::string& x_title, const std::string& y_title,
                     const std::string& unit, const std::vector<WorkspacePanel>& panels) {
  const auto edges = [](double from, double to, std::size_t cells) {
    json list = json::array();
    for (std::size_t i = 0; i <= cells; ++i)
      list.push_back(from + (to - from) * static_cast<double>(i) / static_cast<double>(cells));
    return list;
  };
  json list = json::array();
  for (const WorkspacePanel& panel : panels) {
    json values = json::array(), rows = json::array();
    for (const MapCell& cell : panel.cells) {
      values.push_back(cell.samples < kLeastCellSamples ? kUnknown : cell.rmse);
      rows.push_back(cell.samples);
    }
    list.push_back({{"title", panel.title},
                    {"scale", panel.scale},
                    {"values", std::move(values)},
                    {"rows", std::move(rows)}});
  }
  return drawn_by("map_chart",
                  json::array({description, edges(grid.x_from, grid.x_to, grid.columns),
                               edges(grid.y_from, grid.y_to, grid.rows), std::move(list), x_title,
                               y_title, unit}));
}

}  // namespace ravencal::report
