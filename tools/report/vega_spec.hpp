// SPDX-License-Identifier: Apache-2.0
//
// Pieces of Vega 5 specifications (https://vega.github.io/vega/docs/) that the charts share.
// Colours are the page's CSS variables, so that dark, light and print need one drawing.
#pragma once

#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "report/reduce.hpp"

namespace ravencal::report {

using nlohmann::json;

inline constexpr const char* kTruthColour = "var(--truth)";
inline constexpr const char* kRawColour = "var(--raw)";
inline constexpr const char* kBiasColour = "var(--bias)";
inline constexpr const char* kCorrectedColour = "var(--corrected)";
inline constexpr const char* kInkColour = "currentColor";

/// Interval of a scale.
struct Extent {
  double from = 0.0;
  double to = 1.0;
};

/// Extent of the finite values of all lines, widened by 4 % on both sides; never empty.
Extent extent_of(std::initializer_list<std::span<const Point>> lines);

using Columns = std::vector<std::pair<std::string, std::vector<double>>>;

/// A data set for logarithmic axes: columns travel with five significant digits.
json significant_data(std::string_view name, const Columns& columns);
/// Columns t and v for linear axes.
json line_data(std::string_view name, std::span<const Point> line);

/// `type` "linear", "log", ...; `range` [from, to] in pixels.
json scale(std::string_view name, std::string_view type, Extent domain, double range_from,
           double range_to);
json axis(std::string_view orient, std::string_view scale, std::string_view title);

struct LineStyle {
  std::string colour;
  double width = 1.3;
  std::string dash;  ///< Vega dash array such as "[4,2]"; empty: solid
  std::string interpolate = "linear";
};
/// A line through columns `x_field`, `y_field` of `data`, interrupted where y is missing.
json line_mark(std::string_view data, std::string_view x_field, std::string_view y_field,
               const LineStyle& style);
/// A plot inside a chart: signals and encoding of a group of that place and size. Its signals stand
/// in for the chart's, which is what axes take the length of their grid from.
json plot_area(double x, double y, double width, double height);
/// Ticks 1, 2 and 5 times powers of ten (only the powers if there would be more than 12).
json log_ticks(Extent domain);
/// A horizontal rule at y = 0 across `width` pixels.
json zero_rule(double width);

/// A specification of that plot size; page.js gives it the page's fonts and colours.
json chart(std::string_view description, double width, double height);

}  // namespace ravencal::report
