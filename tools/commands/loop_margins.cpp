// SPDX-License-Identifier: Apache-2.0
#include "commands/loop_margins.hpp"

#include <fmt/format.h>

#include "commands/command.hpp"
#include "physics/plant.hpp"

namespace ravencal::commands {

namespace {

/// The plant's controller, else the one in which the model's recordings were made; without either,
/// encoder values as old as both branches have them.
loop::ServoOptions servo_options(const physics::Plant& plant,
                                 const model::CalibrationModel& model) {
  const physics::ControllerBranch* branch = &plant.robot.controller;
  if (branch->name.empty()) branch = physics::find_controller_branch(model.origin.controller);
  loop::ServoOptions options;
  if (branch == nullptr) return options;
  options.coupled_joint_velocity = branch->couples_velocities;
  options.encoder_age_cycles = branch->reads_encoders_before_sleep ? 1 : 0;
  return options;
}

}  // namespace

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
  RAVENCAL_ASSIGN_OR_RETURN(loop::ServoLoop servo,
                            loop::ServoLoop::create(plant, servo_options(plant, model)));
  RAVENCAL_ASSIGN_OR_RETURN(const loop::OperatingPoints points,
                            loop::operating_points(model, pointers_to(recordings)));
  return loop::margins(model, points, servo);
}

}  // namespace ravencal::commands
