// SPDX-License-Identifier: Apache-2.0
#include "learn/recording_origin.hpp"

#include <fmt/format.h>

#include <string>

#include "learn/motor_coordinates.hpp"

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
  const std::string named = text_or_empty(recording, "coordinates");
  const auto stated = model::coordinates_from(named.empty() ? "unknown" : named);
  if (!stated) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: meta 'coordinates' is '{}'; motor, corrected and unknown "
                                   "are known",
                                   recording.source, named)};
  }
  origin.coordinates = *stated;
  if (recording.meta.contains("plant_hash")) {
    if (named.empty()) origin.coordinates = model::Coordinates::kMotor;
    return origin;
  }
  const MotorCoordinates seen = motor_coordinates(recording);
  if (origin.coordinates == model::Coordinates::kUnknown) origin.coordinates = seen.coordinates;
  if (origin.coordinates == model::Coordinates::kMotor &&
      seen.coordinates == model::Coordinates::kCorrected) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: meta 'coordinates' is 'motor', but jpos is not what the "
                                   "motors' positions give: up to {:.3f} rad are left",
                                   recording.source, seen.unexplained_rad)};
  }
  return origin;
}

core::Result<model::Origin> common_origin(const model::Origin& given,
                                          std::span<const record::Recording* const> recordings) {
  model::Origin origin = given;
  for (const record::Recording* recording : recordings) {
    RAVENCAL_ASSIGN_OR_RETURN(const model::Origin more, origin_of(*recording));
    if (more.coordinates == model::Coordinates::kCorrected &&
        given.coordinates != model::Coordinates::kCorrected) {
      return core::Error{
          core::ErrorCode::kData,
          fmt::format("{}: was recorded while a correction was applied: its joints are not those "
                      "of its motors, and what is left of the error is not the error. Record with "
                      "the plugin off or in shadow; --coordinates corrected trains all the same, "
                      "and no plugin loads that",
                      recording->source)};
    }
    RAVENCAL_ASSIGN_OR_RETURN(origin, model::joined(origin, more, recording->source));
  }
  return origin;
}

}  // namespace ravencal::learn
