// SPDX-License-Identifier: Apache-2.0
#include "model/feature_spec.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <utility>

namespace ravencal::model {
namespace {

core::Error bad_feature(std::string_view text, std::string_view why) {
  return {core::ErrorCode::kUsage,
          fmt::format("feature '{}': {}; write CHANNEL, CHANNEL@ROWS, CHANNEL~HALF_WIDTH, "
                      "CHANNEL%SECONDS or CHANNEL%absSECONDS",
                      text, why)};
}

/// True if all of `text` is a number of that type.
template <typename Number>
bool parse_number(std::string_view text, Number& number) {
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  return error == std::errc{} && rest == end;
}

constexpr std::string_view kAbs = "abs";

/// Reads what follows the %.
core::Result<FeatureSpec> parse_mean(std::string_view text, std::string_view number,
                                     FeatureSpec spec) {
  spec.transform = number.starts_with(kAbs) ? Transform::kMeanOfAbs : Transform::kMean;
  if (spec.transform == Transform::kMeanOfAbs) number.remove_prefix(kAbs.size());
  if (!parse_number(number, spec.time_constant_s) || !is_time_constant(spec.time_constant_s)) {
    return bad_feature(text, fmt::format("'{}' is not a time constant from {} to {} s", number,
                                         kMinTimeConstantS, kMaxTimeConstantS));
  }
  return spec;
}

}  // namespace

std::string FeatureSpec::text() const {
  switch (transform) {
    case Transform::kLag:
      return fmt::format("{}@{}", channel, lag_rows);
    case Transform::kPlay:
      return fmt::format("{}~{}", channel, play_half_width);
    case Transform::kMean:
      return fmt::format("{}%{}", channel, time_constant_s);
    case Transform::kMeanOfAbs:
      return fmt::format("{}%{}{}", channel, kAbs, time_constant_s);
    case Transform::kValue:
      break;
  }
  return channel;
}

core::Result<FeatureSpec> FeatureSpec::parse(std::string_view text) {
  FeatureSpec spec;
  const std::size_t mark = text.find_first_of("@~%");
  spec.channel = text.substr(0, mark);
  if (spec.channel.empty()) return bad_feature(text, "the channel's name is missing");
  if (mark == std::string_view::npos) return spec;
  const std::string_view number = text.substr(mark + 1);
  if (text[mark] == '%') return parse_mean(text, number, std::move(spec));
  if (text[mark] == '@') {
    spec.transform = Transform::kLag;
    if (!parse_number(number, spec.lag_rows) || spec.lag_rows == 0) {
      return bad_feature(text, fmt::format("'{}' is not a number of rows of at least 1", number));
    }
    return spec;
  }
  spec.transform = Transform::kPlay;
  if (!parse_number(number, spec.play_half_width) || !std::isfinite(spec.play_half_width) ||
      spec.play_half_width <= 0.0F) {
    return bad_feature(text, fmt::format("'{}' is not a half-width above 0", number));
  }
  return spec;
}

void add_history(std::vector<FeatureSpec>& features, std::uint32_t history,
                 std::uint32_t step_rows) {
  const std::vector<FeatureSpec> present = features;
  for (std::uint32_t k = 1; k <= history; ++k) {
    for (const FeatureSpec& feature : present) {
      if (feature.transform != Transform::kValue) continue;
      FeatureSpec lagged = feature;
      lagged.transform = Transform::kLag;
      lagged.lag_rows = k * step_rows;
      features.push_back(lagged);
    }
  }
}

}  // namespace ravencal::model
