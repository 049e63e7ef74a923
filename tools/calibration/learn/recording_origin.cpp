// SPDX-License-Identifier: Apache-2.0
#include "learn/recording_origin.hpp"

#include <fmt/format.h>

#include <string>

namespace ravencal::learn {
namespace {

std::string text_or_empty(const record::Recording& recording, const char* key) {
  const auto entry = recording.meta.find(key);
  return entry == recording.meta.end() ? std::string() : entry->second;
}

}  // namespace

core::Result<model::Origin> origin_of(const record::Recording& recording) {
  model::Origin origin;
  origin.robot = text_or_empty(recording, "robot");
  origin.controller = text_or_empty(recording, "controller");
  origin.arm = model::arm_from(text_or_empty(recording, "arm")).value_or(model::Arm::kUnknown);
  const std::string coordinates = text_or_empty(recording, "coordinates");
  if (coordinates.empty()) {
    const bool is_simulated = recording.meta.contains("plant_hash");
    if (is_simulated) origin.coordinates = model::Coordinates::kMotor;
    return origin;
  }
  const auto named = model::coordinates_from(coordinates);
  if (!named) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: meta 'coordinates' is '{}'; motor, corrected and unknown "
                                   "are known",
                                   recording.source, coordinates)};
  }
  origin.coordinates = *named;
  return origin;
}

core::Result<model::Origin> common_origin(const model::Origin& given,
                                          std::span<const record::Recording* const> recordings) {
  model::Origin origin = given;
  for (const record::Recording* recording : recordings) {
    RAVENCAL_ASSIGN_OR_RETURN(const model::Origin more, origin_of(*recording));
    RAVENCAL_ASSIGN_OR_RETURN(origin, model::joined(origin, more, recording->source));
  }
  return origin;
}

}  // namespace ravencal::learn
