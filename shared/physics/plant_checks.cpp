// SPDX-License-Identifier: Apache-2.0
#include "physics/plant_checks.hpp"

#include <fmt/format.h>

#include "physics/plant_effort.hpp"

namespace ravencal::physics {
namespace {

core::Status check_routing(const Plant& plant) {
  for (std::size_t i = 0; i < plant.joints.size(); ++i) {
    if (!plant.joints[i].coupling_through || coupled(plant, i)) continue;
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("{}: joint '{}' has coupling_through, but by `coupling` no joint moves it",
                    plant.source, plant.joints[i].name)};
  }
  return {};
}

/// The geometry is whole, and a joint is carried by one before it.
core::Status check_frames(const Plant& plant) {
  for (std::size_t i = 0; i < plant.joints.size(); ++i) {
    const Joint& joint = plant.joints[i];
    if (joint.frame.has_value() != plant.joints.front().frame.has_value())
      return core::data_error(fmt::format(
          "{}: joint '{}' {} a [joint.frame] and joint '{}' {}: all joints need one, or "
          "none",
          plant.source, joint.name, joint.frame ? "has" : "lacks", plant.joints.front().name,
          joint.frame ? "lacks it" : "has it"));
    if (!joint.frame || joint.frame->carried_by.empty()) continue;
    if (plant.joint_index(joint.frame->carried_by).value_or(i) >= i)
      return core::data_error(fmt::format("{}: joint '{}': carried_by '{}' is no joint before it",
                                          plant.source, joint.name, joint.frame->carried_by));
  }
  return {};
}

/// Nothing weighs in silence nothing.
core::Status check_gravity(const Plant& plant, bool stated) {
  if (stated || !(moved_mass_kg(plant) > 0.0)) return {};
  return core::data_error(fmt::format(
      "{}: links have masses and [robot] states no gravity_m_per_s2: three numbers in the frame of "
      "the base, such as [0.0, 0.0, -9.81], or zeros where nothing pulls at them",
      plant.source));
}

core::Status check_names(const Plant& plant) {
  for (std::size_t i = 0; i < plant.joints.size(); ++i) {
    const Joint& joint = plant.joints[i];
    if (plant.joint_index(joint.name) != i) {
      return core::Error{core::ErrorCode::kData,
                         fmt::format("{}: two joints are called '{}'", plant.source, joint.name)};
    }
    for (const Effect& effect : joint.effects) {
      const bool of_joint = effect.id == "coupling" || effect.id == "hysteresis";
      if (of_joint && !effect.from.empty() && plant.joint_index(effect.from).value_or(i) == i) {
        return core::Error{core::ErrorCode::kData,
                           fmt::format("{}: joint '{}': {} from '{}': name another joint",
                                       plant.source, joint.name, effect.id, effect.from)};
      }
    }
  }
  return {};
}

}  // namespace

core::Status check_plant(const Plant& plant, bool gravity_stated) {
  RAVENCAL_RETURN_IF_ERROR(check_routing(plant));
  RAVENCAL_RETURN_IF_ERROR(check_names(plant));
  RAVENCAL_RETURN_IF_ERROR(check_frames(plant));
  return check_gravity(plant, gravity_stated);
}

}  // namespace ravencal::physics
