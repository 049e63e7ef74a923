// SPDX-License-Identifier: Apache-2.0
#include "commands/loop_margins.hpp"

#include <fmt/format.h>

#include "commands/command.hpp"
#include "physics/plant.hpp"

namespace ravencal::commands {

core::Result<loop::Margins> margins_with(const std::string& plant_file,
                                         const model::CalibrationModel& model,
                                         const std::vector<record::Recording>& recordings) {
  RAVENCAL_ASSIGN_OR_RETURN(const physics::Plant plant, physics::load_plant(plant_file));
  const auto arm = model::arm_from(plant.robot.arm).value_or(model::Arm::kUnknown);
  if (arm != model::Arm::kUnknown && model.origin.arm != model::Arm::kUnknown &&
      arm != model.origin.arm) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: is of the {} arm, but the model of the {} arm", plant_file,
                                   name_of(arm), name_of(model.origin.arm))};
  }
  loop::ServoOptions options;
  options.coupled_joint_velocity = model.origin.controller == "crtk";
  RAVENCAL_ASSIGN_OR_RETURN(loop::ServoLoop servo, loop::ServoLoop::create(plant, options));
  RAVENCAL_ASSIGN_OR_RETURN(const loop::OperatingPoints points,
                            loop::operating_points(model, pointers_to(recordings)));
  return loop::margins(model, points, servo);
}

}  // namespace ravencal::commands
