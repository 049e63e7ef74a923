// SPDX-License-Identifier: Apache-2.0
#include "rezero/pose.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <string_view>

#include "cli/numbers.hpp"
#include "core/units.hpp"

namespace ravencal::rezero {
namespace {

/// "30deg" in SI, if the unit is of that kind.
std::optional<double> quantity(const std::string& text, const std::string& unit_si) {
  const auto number = cli::leading_number(text);
  const auto unit = number ? core::find_unit(number->second) : std::nullopt;
  if (!unit || unit->si_name != unit_si) return std::nullopt;
  return number->first * unit->to_si;
}

/// What stands before and after the sign of an uncertainty; without one, all and nothing.
std::pair<std::string, std::string> at_sign(const std::string& text) {
  for (const std::string_view sign : {"+-", "±"}) {
    const auto at = text.find(sign);
    if (at != text.npos) return {text.substr(0, at), text.substr(at + sign.size())};
  }
  return {text, ""};
}

const model::OutputSpec* output_of(const model::CalibrationModel& model, std::string_view joint) {
  const auto found = std::find_if(model.outputs.begin(), model.outputs.end(),
                                  [&](const auto& output) { return output.joint == joint; });
  return found == model.outputs.end() ? nullptr : &*found;
}

std::string joints_of(const model::CalibrationModel& model) {
  std::vector<std::string> joints;
  for (const model::OutputSpec& output : model.outputs) joints.push_back(output.joint);
  return fmt::format("{}", fmt::join(joints, ", "));
}

core::Error not_understood(std::string_view option, const std::string& text, std::string_view form,
                           const model::CalibrationModel& model) {
  return core::usage_error(
      fmt::format("{} {}: must be {}, of a joint that the weights correct ({})", option, text, form,
                  joints_of(model)));
}

template <typename Value>
core::Status add(std::string_view option, Value value, std::vector<Value>& values) {
  for (const Value& other : values) {
    if (other.joint == value.joint) {
      return core::usage_error(fmt::format("{}: {} is there twice", option, value.joint));
    }
  }
  values.push_back(std::move(value));
  return {};
}

}  // namespace

core::Result<std::vector<KnownJoint>> parse_pose(std::span<const std::string> texts,
                                                 const model::CalibrationModel& model) {
  std::vector<KnownJoint> pose;
  for (const std::string& text : texts) {
    const std::string joint = text.substr(0, text.find('='));
    const model::OutputSpec* const output = output_of(model, joint);
    const auto [value, uncertainty] = at_sign(text.substr(std::min(joint.size() + 1, text.size())));
    const auto value_si = output != nullptr ? quantity(value, output->unit) : std::nullopt;
    const auto uncertainty_si =
        output != nullptr ? quantity(uncertainty, output->unit) : std::nullopt;
    if (!value_si || !uncertainty_si || *uncertainty_si < 0.0) {
      return not_understood("--at", text,
                            "JOINT=VALUE+-UNCERTAINTY with units, as elbow=90deg+-0.1deg or "
                            "insertion=400mm+-0.2mm",
                            model);
    }
    RAVENCAL_RETURN_IF_ERROR(add("--at", KnownJoint{joint, *value_si, *uncertainty_si}, pose));
  }
  return pose;
}

core::Result<std::vector<JointValue>> parse_bounds(std::span<const std::string> texts,
                                                   const model::CalibrationModel& model) {
  std::vector<JointValue> bounds;
  for (const std::string& text : texts) {
    const std::string joint = text.substr(0, text.find('='));
    const model::OutputSpec* const output = output_of(model, joint);
    const auto value_si =
        output != nullptr
            ? quantity(text.substr(std::min(joint.size() + 1, text.size())), output->unit)
            : std::nullopt;
    if (!value_si || !(*value_si > 0.0)) {
      return not_understood("--at-most", text, "JOINT=VALUE above 0 with its unit, as elbow=2deg",
                            model);
    }
    RAVENCAL_RETURN_IF_ERROR(add("--at-most", JointValue{joint, *value_si}, bounds));
  }
  return bounds;
}

}  // namespace ravencal::rezero
