// SPDX-License-Identifier: Apache-2.0
#include "report/study_charts.hpp"

#include <utility>

#include <nlohmann/json.hpp>

#include "report/charts.hpp"

namespace ravencal::report {
namespace {

using nlohmann::json;

/// A chart that draw.js makes: its function and arguments, null for what is not finite.
json drawn_by(const char* function, json arguments) {
  return {{"draw", function}, {"arguments", std::move(arguments)}};
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
  json list = json::array();
  for (const SettingPanel& panel : panels) {
    json lines = json::array();
    for (const SettingLine& line : panel.lines) {
      lines.push_back(
          {{"name", line.name}, {"values", line.values}, {"low", line.low}, {"high", line.high}});
    }
    list.push_back({{"title", panel.title}, {"unit", panel.unit}, {"lines", std::move(lines)}});
  }
  return drawn_by("setting_chart", json::array({description, setting_title, std::move(list)}));
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
