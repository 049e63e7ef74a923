// SPDX-License-Identifier: Apache-2.0
#include "report/study_charts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "report/charts.hpp"
#include "report/tables.hpp"
#include "report/vega_spec.hpp"

namespace ravencal::report {
namespace {

/// Okabe and Ito, "Color Universal Design" (2008), but black and yellow.
constexpr std::array kLineColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                     "#e69f00", "#56b4e9", "#808890"};

// ------------------------------------------------------------------ bars

constexpr double kBarStep = 19;
constexpr double kBarHeight = 11;
constexpr double kLabelWidth = 230;
constexpr double kBarPanelWidth = 220;
constexpr double kBarPanelStep = kBarPanelWidth + 62;  // room for the figure beside the bar
constexpr double kCut = 6.0;

double end_of(const BarPanel& panel) {
  double greatest = 0.0;
  for (const Bar& bar : panel.bars) {
    for (const double reach : {bar.value, bar.high}) {
      if (std::isfinite(reach)) greatest = std::max(greatest, reach);
    }
  }
  const bool has_reference = std::isfinite(panel.reference) && panel.reference > 0.0;
  if (has_reference) greatest = std::min(greatest, kCut * panel.reference);
  return greatest > 0.0 ? 1.02 * greatest : 1.0;
}

/// One bar, its interval and its figure.
void add_bar(const Bar& bar, double y, double pixels_per_unit, int decimals, json& marks) {
  if (!std::isfinite(bar.value)) return;
  const auto at = [&](double reach) {
    return std::clamp(reach * pixels_per_unit, 0.0, kBarPanelWidth);
  };
  marks.push_back({{"type", "rect"},
                   {"encode",
                    {{"enter",
                      {{"x", value(0)},
                       {"width", value(at(bar.value))},
                       {"y", value(y - kBarHeight / 2)},
                       {"height", value(kBarHeight)},
                       {"fill", {{"value", bar.marked ? kRawColour : kCorrectedColour}}}}}}}});
  double figure_x = at(bar.value);
  if (std::isfinite(bar.low) && std::isfinite(bar.high)) {
    marks.push_back(rule_mark(at(bar.low), y, at(bar.high), y, kInkColour, 1.5));
    figure_x = std::max(figure_x, at(bar.high));
  }
  marks.push_back(text_mark(figure_x + 5, y, fmt::format("{:.{}f}", bar.value, decimals)));
}

json bar_panel(const BarPanel& panel, double x, double height) {
  const double end = end_of(panel);
  double least = kUnknown;
  for (const Bar& bar : panel.bars) {
    if (std::isfinite(bar.value) && bar.value > 0.0) least = std::fmin(least, bar.value);
  }
  json group = plot_area(x, 18, kBarPanelWidth, height);
  group["scales"] = {scale("x", "linear", {0, end}, 0, kBarPanelWidth)};
  json x_axis = axis("bottom", "x", fmt::format("RMSE [{}]", panel.unit));
  x_axis["tickCount"] = 4;
  group["axes"] = {std::move(x_axis)};
  json marks = json::array();
  marks.push_back(text_mark(0, -10, panel.title));
  for (std::size_t i = 0; i < panel.bars.size(); ++i) {
    add_bar(panel.bars[i], (static_cast<double>(i) + 0.5) * kBarStep, kBarPanelWidth / end,
            decimals_for(least), marks);
  }
  if (std::isfinite(panel.reference)) {
    const double reference_x = panel.reference / end * kBarPanelWidth;
    json rule = rule_mark(reference_x, 0, reference_x, height, kInkColour, 1);
    rule["encode"]["enter"]["strokeDash"] = {{"value", {3, 3}}};
    marks.push_back(std::move(rule));
  }
  group["marks"] = std::move(marks);
  return group;
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

// ------------------------------------------------------------------ maps

constexpr double kMapWidth = 250;
constexpr double kMapHeight = 180;
constexpr double kMapStep = kMapWidth + 40;

json workspace_data(const std::string& name, const MapGrid& grid,
                    const std::vector<MapCell>& cells) {
  json rows = json::array();
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].samples < kLeastCellSamples || !std::isfinite(cells[i].rmse)) continue;
    rows.push_back({{"column", i % grid.columns},
                    {"row", i / grid.columns},
                    {"rmse", cells[i].rmse},
                    {"samples", cells[i].samples}});
  }
  return {{"name", name}, {"values", std::move(rows)}};
}

double greatest_of(const std::vector<WorkspacePanel>& panels, std::size_t scale_index) {
  double greatest = 0.0;
  for (const WorkspacePanel& panel : panels) {
    if (panel.scale != scale_index) continue;
    for (const MapCell& cell : panel.cells) {
      if (cell.samples >= kLeastCellSamples && std::isfinite(cell.rmse)) {
        greatest = std::max(greatest, cell.rmse);
      }
    }
  }
  return greatest > 0.0 ? greatest : 1.0;
}

json workspace_panel(const WorkspacePanel& panel, const std::string& data, double x,
                     const MapGrid& grid) {
  const double width = kMapWidth / static_cast<double>(grid.columns);
  const double height = kMapHeight / static_cast<double>(grid.rows);
  json group = plot_area(x, 18, kMapWidth, kMapHeight);
  group["encode"]["enter"]["fill"] = {{"value", "url(#untested)"}};
  json cells = {{"type", "rect"},
                {"from", {{"data", data}}},
                {"encode",
                 {{"enter",
                   {{"x", {{"field", "column"}, {"mult", width}}},
                    {"width", value(width)},
                    {"y", {{"field", "row"}, {"mult", -height}, {"offset", kMapHeight - height}}},
                    {"height", value(height)},
                    {"fill", {{"scale", fmt::format("colour_{}", panel.scale)}, {"field", "rmse"}}},
                    {"tooltip",
                     {{"signal",
                       "format(datum.rmse, '.3~g') + ' ' + unit + ' RMSE, ' + "
                       "format(datum.samples, 'd') + ' samples'"}}}}}}}};
  group["marks"] = {std::move(cells), text_mark(0, -10, panel.title)};
  return group;
}

}  // namespace

json bar_chart(const std::string& description, const std::vector<std::string>& labels,
               const std::vector<BarPanel>& panels) {
  const double height = kBarStep * static_cast<double>(labels.size());
  json spec = chart(description, kLabelWidth + kBarPanelStep * static_cast<double>(panels.size()),
                    height + 50);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    spec["marks"].push_back(text_mark(
        kLabelWidth - 8, 18 + (static_cast<double>(i) + 0.5) * kBarStep, labels[i], "right"));
  }
  double x = kLabelWidth;
  for (const BarPanel& panel : panels) {
    spec["marks"].push_back(bar_panel(panel, x, height));
    x += kBarPanelStep;
  }
  return spec;
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
  json spec = chart(description, kMapStep * static_cast<double>(panels.size()), kMapHeight + 110);
  spec["signals"] = {{{"name", "unit"}, {"value", unit}}};
  spec["scales"] = {scale("x", "linear", {grid.x_from, grid.x_to}, 0, kMapWidth),
                    scale("y", "linear", {grid.y_from, grid.y_to}, kMapHeight, 0)};
  spec["legends"] = json::array();
  std::array<bool, 2> has_legend = {false, false};
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const std::string data = fmt::format("map_{}", i);
    spec["data"].push_back(workspace_data(data, grid, panels[i].cells));
    const double x = kMapStep * static_cast<double>(i);
    json group = workspace_panel(panels[i], data, x, grid);
    json x_axis = axis("bottom", "x", x_title);
    json y_axis = axis("left", "y", i == 0 ? y_title : "");
    y_axis["labels"] = i == 0;
    for (json* one : {&x_axis, &y_axis}) {
      (*one)["grid"] = false;
      (*one)["tickCount"] = 5;
    }
    group["axes"] = {std::move(x_axis), std::move(y_axis)};
    spec["marks"].push_back(std::move(group));
    const std::size_t colours = panels[i].scale;
    if (std::exchange(has_legend.at(colours), true)) continue;
    const std::string name = fmt::format("colour_{}", colours);
    spec["scales"].push_back({{"name", name},
                              {"type", "linear"},
                              {"domain", {0.0, greatest_of(panels, colours)}},
                              {"range", {{"scheme", "viridis"}}},
                              {"clamp", true},
                              {"zero", true}});
    spec["legends"].push_back({{"fill", name},
                               {"type", "gradient"},
                               {"direction", "horizontal"},
                               {"orient", "none"},
                               {"legendX", x},
                               {"legendY", kMapHeight + 66},
                               {"gradientLength", kMapWidth},
                               {"tickCount", 3},
                               {"gradientThickness", 10},
                               {"title", fmt::format("RMSE [{}]", unit)}});
  }
  return spec;
}

}  // namespace ravencal::report
