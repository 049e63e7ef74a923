// SPDX-License-Identifier: Apache-2.0
#include "report/vega_spec.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace ravencal::report {
namespace {

/// Largest power of ten that resolves 1/4000 of the range.
double quantum_of(const std::vector<double>& values) {
  double least = std::numeric_limits<double>::infinity();
  double greatest = -least;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    least = std::min(least, value);
    greatest = std::max(greatest, value);
  }
  double range = greatest - least;
  if (!(range > 0) || !std::isfinite(range)) {
    range = std::isfinite(greatest) && greatest != 0 ? std::abs(greatest) : 1.0;
  }
  return std::pow(10.0, std::floor(std::log10(range / 4000)));
}

/// Columns travel as whole multiples of a quantum fine enough for a screen (1/4000 of the column's
/// range or finer); page.js makes rows of them.
json columns_data(std::string_view name, const Columns& columns) {
  json encoded = json::object();
  for (const auto& [column, values] : columns) {
    const double quantum = quantum_of(values);
    json whole = json::array();
    for (const double value : values) {
      if (std::isfinite(value)) {
        whole.push_back(std::llround(value / quantum));
      } else {
        whole.push_back(nullptr);
      }
    }
    encoded[column] = {{"q", quantum}, {"v", std::move(whole)}};
  }
  return {{"name", name}, {"columns", std::move(encoded)}};
}

}  // namespace

Extent extent_of(std::initializer_list<std::span<const Point>> lines) {
  double least = std::numeric_limits<double>::infinity();
  double greatest = -least;
  for (const auto& line : lines) {
    for (const Point& point : line) {
      if (!std::isfinite(point.value)) continue;
      least = std::min(least, point.value);
      greatest = std::max(greatest, point.value);
    }
  }
  if (!(least <= greatest)) return {-1.0, 1.0};
  double margin = 0.04 * (greatest - least);
  if (!(margin > 0)) margin = greatest != 0 ? 0.1 * std::abs(greatest) : 1.0;
  return {least - margin, greatest + margin};
}

json significant_data(std::string_view name, const Columns& columns) {
  json encoded = json::object();
  for (const auto& [column, values] : columns) {
    json rounded = json::array();
    for (const double value : values) {
      if (std::isfinite(value)) {
        rounded.push_back(std::strtod(fmt::format("{:.5g}", value).c_str(), nullptr));
      } else {
        rounded.push_back(nullptr);
      }
    }
    encoded[column] = {{"q", 1}, {"v", std::move(rounded)}};
  }
  return {{"name", name}, {"columns", std::move(encoded)}};
}

json line_data(std::string_view name, std::span<const Point> line) {
  std::vector<double> t_s;
  std::vector<double> values;
  for (const Point& point : line) {
    t_s.push_back(point.t_s);
    values.push_back(point.value);
  }
  return columns_data(name, {{"t", std::move(t_s)}, {"v", std::move(values)}});
}

json scale(std::string_view name, std::string_view type, Extent domain, double range_from,
           double range_to) {
  return {{"name", name},
          {"type", type},
          {"domain", json::array({domain.from, domain.to})},
          {"range", json::array({range_from, range_to})},
          {"nice", false},
          {"zero", false}};
}

json axis(std::string_view orient, std::string_view scale, std::string_view title) {
  return {{"orient", orient}, {"scale", scale}, {"title", title}, {"grid", true}};
}

json line_mark(std::string_view data, std::string_view x_field, std::string_view y_field,
               const LineStyle& style) {
  json enter = {{"x", {{"scale", "x"}, {"field", x_field}}},
                {"y", {{"scale", "y"}, {"field", y_field}}},
                {"defined", {{"signal", "isValid(datum['" + std::string(y_field) + "'])"}}},
                {"interpolate", {{"value", style.interpolate}}},
                {"stroke", {{"value", style.colour}}},
                {"strokeWidth", {{"value", style.width}}},
                {"strokeJoin", {{"value", "round"}}}};
  if (!style.dash.empty()) enter["strokeDash"] = {{"value", json::parse(style.dash)}};
  return {{"type", "line"},
          {"from", {{"data", data}}},
          {"clip", true},
          {"interactive", false},
          {"encode", {{"enter", std::move(enter)}}}};
}

json zero_rule(double width) {
  return {{"type", "rule"},
          {"encode",
           {{"enter",
             {{"x", {{"value", 0}}},
              {"x2", {{"value", width}}},
              {"y", {{"scale", "y"}, {"value", 0}}},
              {"stroke", {{"value", kInkColour}}},
              {"strokeWidth", {{"value", 0.8}}}}}}}};
}

json plot_area(double x, double y, double width, double height) {
  return {
      {"type", "group"},
      {"signals", {{{"name", "width"}, {"value", width}}, {{"name", "height"}, {"value", height}}}},
      {"encode",
       {{"enter",
         {{"x", {{"value", x}}},
          {"y", {{"value", y}}},
          {"width", {{"value", width}}},
          {"height", {{"value", height}}}}}}}};
}

json log_ticks(Extent domain) {
  const auto first = static_cast<int>(std::floor(std::log10(domain.from)));
  const auto last = static_cast<int>(std::floor(std::log10(domain.to)));
  const auto ticks = [&](std::initializer_list<double> steps) {
    json values = json::array();
    for (int exponent = first; exponent <= last; ++exponent) {
      for (const double step : steps) {
        const double tick = step * std::pow(10.0, exponent);
        if (tick >= domain.from && tick <= domain.to) values.push_back(tick);
      }
    }
    return values;
  };
  constexpr std::size_t kMostTicks = 12;
  json values = ticks({1, 2, 5});
  return values.size() > kMostTicks ? ticks({1}) : values;
}

json chart(std::string_view description, double width, double height) {
  return {{"$schema", "https://vega.github.io/schema/vega/v5.json"},
          {"description", description},
          {"width", width},
          {"height", height},
          {"padding", 4},
          {"autosize", "pad"},
          {"data", json::array()},
          {"scales", json::array()},
          {"axes", json::array()},
          {"marks", json::array()}};
}

}  // namespace ravencal::report
