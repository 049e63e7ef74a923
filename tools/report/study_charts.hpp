// SPDX-License-Identifier: Apache-2.0
//
// Charts of studies, which compare many results: bars with intervals, figures over a few settings,
// errors over the workspace. Any unit; what is not finite is left out. They say what is drawn;
// page/draw.js draws it.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "report/reduce.hpp"

namespace ravencal::report {

/// One bar: `low` and `high` are its interval (NaN: none).
struct Bar {
  double value = 0.0;
  double low = 0.0;
  double high = 0.0;
  bool marked = false;  ///< drawn in the other colour
};

/// Bars beside each other that share an axis and a reference line.
struct BarPanel {
  std::string title;       ///< e.g. "shoulder"
  std::string unit;        ///< e.g. "deg"
  double reference = 0.0;  ///< NaN: none
  std::vector<Bar> bars;   ///< one per label of the chart
};

/// Horizontal bars from zero, one line per label, panels side by side. A panel ends at six times
/// its reference (or at its greatest bar, where there is none): longer bars are cut there, and
/// their figures stand beside them.
nlohmann::json bar_chart(const std::string& description, const std::vector<std::string>& labels,
                         const std::vector<BarPanel>& panels);

/// One line through a few settings.
struct SettingLine {
  std::string name;
  std::vector<double> values;  ///< one per setting
  std::vector<double> low;
  std::vector<double> high;
};

struct SettingPanel {
  std::string title;
  std::string unit;
  std::vector<SettingLine> lines;  ///< the same names in every panel
};

/// Values on a logarithmic axis over settings 0, 1, 2, ..., panels side by side; up to seven lines.
nlohmann::json setting_chart(const std::string& description, const std::string& setting_title,
                             const std::vector<SettingPanel>& panels);

/// RMS errors over the workspace; panels with the same `scale` share colours.
struct WorkspacePanel {
  std::string title;
  std::size_t scale = 0;  ///< 0 or 1
  std::vector<MapCell> cells;
};

/// Panels side by side over one grid. Axis titles with their units.
nlohmann::json workspace_chart(const std::string& description, const MapGrid& grid,
                               const std::string& x_title, const std::string& y_title,
                               const std::string& unit, const std::vector<WorkspacePanel>& panels);

}  // namespace ravencal::report
