// SPDX-License-Identifier: Apache-2.0
#include "model/feature_spec.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

namespace ravencal::model {
namespace {

core::Error bad_feature(std::string_view text, std::string_view why) {
  return {core::ErrorCode::kUsage,
          fmt::format("feature '{}': {}; write CHANNEL, CHANNEL@ROWS, CHANNEL~HALF_WIDTH, "
                      "CHANNEL%SECONDS, CHANNEL%absSECONDS, CHANNEL%LENGTH:POSITION or "
                      "CHANNEL%absLENGTH:POSITION",
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

/// Reads LENGTH:POSITION, whose colon is at `colon`.
core::Result<FeatureSpec> parse_travel_mean(std::string_view text, std::string_view rest,
                                            std::size_t colon, FeatureSpec spec) {
  spec.transform = rest.starts_with(kAbs) ? Transform::kTravelMeanOfAbs : Transform::kTravelMean;
  const std::size_t from = spec.transform == Transform::kTravelMeanOfAbs ? kAbs.size() : 0;
  const std::string_view number = rest.substr(from, colon - from);
  if (!parse_number(number, spec.travel_si) || !is_travel(spec.travel_si)) {
    return bad_feature(text, fmt::format("'{}' is not a length of travel from {} to {}", number,
                                         kMinTravelSi, kMaxTravelSi));
  }
  spec.along = rest.substr(colon + 1);
  if (spec.along.empty()) return bad_feature(text, "the position's name is missing");
  if (spec.along.find_first_of("@~%*") != std::string::npos) {
    return bad_feature(text, fmt::format("'{}' is not the name of one position", spec.along));
  }
  return spec;
}

/// Reads what follows the %.
core::Result<FeatureSpec> parse_mean(std::string_view text, std::string_view number,
                                     FeatureSpec spec) {
  const std::size_t colon = number.find(':');
  if (colon != std::string_view::npos) {
    return parse_travel_mean(text, number, colon, std::move(spec));
  }
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
    case Transform::kTravelMean:
      return fmt::format("{}%{}:{}", channel, travel_si, along);
    case Transform::kTravelMeanOfAbs:
      return fmt::format("{}%{}{}:{}", channel, kAbs, travel_si, along);
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

std::optional<std::size_t> position_of(std::span<const FeatureSpec> features,
                                       const FeatureSpec& feature) {
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (features[i].transform == Transform::kValue && features[i].channel == feature.along) {
      return i;
    }
  }
  return std::nullopt;
}

bool is_needed_position(std::span<const FeatureSpec> features, std::size_t i) {
  return std::any_of(features.begin(), features.end(), [&](const FeatureSpec& feature) {
    return is_travel_mean(feature.transform) && position_of(features, feature) == i;
  });
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
