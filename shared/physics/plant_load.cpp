// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <utility>

#include "core/whole_file.hpp"
#include "physics/plant.hpp"
#include "physics/plant_writer.hpp"
#include "physics/robot_model/plant_of_model.hpp"
#include "physics/robot_model/robot_file.hpp"
#include "physics/robot_model/robot_writer.hpp"

namespace ravencal::physics {
namespace {

core::Result<Plant> plant_of_robot(const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(RobotFile robot, read_robot_file(path));
  RAVENCAL_ASSIGN_OR_RETURN(const Plant made, plant_of_model(*robot.model, path.string()));
  core::Result<Plant> plant = parse_plant(plant_text(made), path.string());
  if (!plant.ok()) return core::data_error(fmt::format("as a plant, {}", plant.error().message));
  plant->notes = std::move(robot.notes);
  plant->notes.insert(plant->notes.end(), made.notes.begin(), made.notes.end());
  return plant;
}

}  // namespace

core::Result<Plant> load_plant(const std::filesystem::path& path) {
  if (is_robot_model(path)) return plant_of_robot(path);
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(path));
  return parse_plant(text, path.string());
}

}  // namespace ravencal::physics
