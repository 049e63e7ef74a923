// SPDX-License-Identifier: Apache-2.0
//
// The charts of report.html as Vega specifications, no wider than a printed page can show legibly.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "diagnose/findings/effect_words.hpp"
#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// Degrees and millimetres for people; everything else as it is.
double display_factor(std::string_view unit);
std::string display_unit(std::string_view unit);

/// What was recorded and what the plant simulates before and after, their errors below.
nlohmann::json trace_chart(const ChannelPlot& plot, const Trace& trace);

/// A value with its 95 % interval.
struct IntervalRow {
  std::string label;
  double value = 0.0;
  double low = 0.0, high = 0.0;  ///< NaN: none
  std::string text;              ///< stands at the end of the row
  bool worse = false;
};
/// One row each beside the `reference`; nothing is cut but what exceeds `most` in size.
nlohmann::json interval_chart(const std::string& description, const std::string& x_title,
                              double reference, double most, const std::vector<IntervalRow>& rows);

/// Residual over one circumstance, without the findings and with them, on axes of one scale.
/// Triangles: the joint moves backwards. Null where the channel has too few of such points.
nlohmann::json residual_chart(const ChannelPlot& plot, Abscissa abscissa);
/// Residual over the time since the joint stopped.
nlohmann::json rest_chart(const ChannelPlot& plot);

/// RMS over position and speed, before and after; null where the motion spans none.
nlohmann::json where_chart(const ChannelPlot& plot);

/// Held-out RMS as the model grows.
nlohmann::json waterfall_chart(const ChannelPlot& plot);

}  // namespace ravencal::diagnose
