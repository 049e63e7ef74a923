// SPDX-License-Identifier: Apache-2.0
#include "model/origin.hpp"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>

#include "model/origin_json.hpp"

namespace ravencal::model {
namespace {

constexpr std::array<std::string_view, 3> kArmNames = {"unknown", "gold", "green"};
constexpr std::array<std::string_view, 3> kCoordinatesNames = {"unknown", "motor", "corrected"};

template <typename Kind>
std::optional<Kind> kind_from(std::string_view name, const std::array<std::string_view, 3>& names) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name) return static_cast<Kind>(i);
  }
  return std::nullopt;
}

core::Error disagree(std::string_view source, std::string_view what, std::string_view more,
                     std::string_view known) {
  return {core::ErrorCode::kData,
          fmt::format("{}: the {} is '{}', but '{}' elsewhere; one model is of one arm, one robot, "
                      "one controller and one kind of coordinates",
                      source, what, more, known)};
}

template <typename Kind>
core::Status join_kind(Kind& known, Kind more, std::string_view what, std::string_view source) {
  if (more == Kind::kUnknown) return {};
  if (known != Kind::kUnknown && known != more) {
    return disagree(source, what, name_of(more), name_of(known));
  }
  known = more;
  return {};
}

core::Status join_text(std::string& known, const std::string& more, std::string_view what,
                       std::string_view source) {
  if (more.empty()) return {};
  if (!known.empty() && known != more) return disagree(source, what, more, known);
  known = more;
  return {};
}

}  // namespace

std::string_view name_of(Arm arm) { return kArmNames[static_cast<std::size_t>(arm)]; }
std::string_view name_of(Coordinates coordinates) {
  return kCoordinatesNames[static_cast<std::size_t>(coordinates)];
}
std::optional<Arm> arm_from(std::string_view name) { return kind_from<Arm>(name, kArmNames); }
std::optional<Coordinates> coordinates_from(std::string_view name) {
  return kind_from<Coordinates>(name, kCoordinatesNames);
}

std::string describe(const Origin& origin) {
  return fmt::format("{} arm of {}, controller {}, inputs in {} coordinates", name_of(origin.arm),
                     origin.robot.empty() ? "an unknown robot" : origin.robot,
                     origin.controller.empty() ? "unknown" : origin.controller,
                     name_of(origin.coordinates));
}

core::Result<Origin> joined(const Origin& known, const Origin& more, std::string_view source) {
  Origin result = known;
  RAVENCAL_RETURN_IF_ERROR(join_kind(result.arm, more.arm, "arm", source));
  RAVENCAL_RETURN_IF_ERROR(
      join_kind(result.coordinates, more.coordinates, "kind of coordinates", source));
  RAVENCAL_RETURN_IF_ERROR(join_text(result.robot, more.robot, "robot", source));
  RAVENCAL_RETURN_IF_ERROR(join_text(result.controller, more.controller, "controller", source));
  return result;
}

nlohmann::ordered_json origin_json(const Origin& origin) {
  return {{"arm", name_of(origin.arm)},
          {"robot", origin.robot},
          {"controller", origin.controller},
          {"coordinates", name_of(origin.coordinates)}};
}

}  // namespace ravencal::model
