// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <string>
#include <vector>

#include "core/isolated.hpp"
#include "core/whole_file.hpp"
#include "physics/plant.hpp"
#include "physics/plant_writer.hpp"
#include "physics/robot_model/plant_of_model.hpp"
#include "physics/robot_model/robot_file.hpp"
#include "physics/robot_model/robot_writer.hpp"

namespace ravencal::physics {
namespace {

/// The library that compiles models trusts their authors: it works in a child process, which sends
/// the plant's text and then its notes.
core::Result<Plant> plant_of_robot(const std::filesystem::path& path) {
  std::vector<std::string> said;
  const auto work = [&](const core::TakePiece& send) -> core::Status {
    RAVENCAL_ASSIGN_OR_RETURN(RobotFile robot, read_robot_file(path));
    RAVENCAL_ASSIGN_OR_RETURN(const Plant made,
                              plant_of_model(*robot.model, path.string(), robot.words));
    RAVENCAL_RETURN_IF_ERROR(core::send_text(send, plant_text(made)));
    robot.notes.insert(robot.notes.end(), made.notes.begin(), made.notes.end());
    for (const std::string& note : robot.notes) {
      RAVENCAL_RETURN_IF_ERROR(core::send_text(send, note));
    }
    return {};
  };
  RAVENCAL_RETURN_IF_ERROR(
      core::in_child(path, "read", core::Isolation::reading(path), work, core::texts_into(said)));
  core::Result<Plant> plant = parse_plant(said.front(), path.string() + " as a plant");
  if (!plant.ok()) return plant.error();
  plant->source = path.string();
  plant->notes.assign(said.begin() + 1, said.end());
  return plant;
}

}  // namespace

core::Result<Plant> load_plant(const std::filesystem::path& path) {
  if (is_robot_model(path)) return plant_of_robot(path);
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(path));
  return parse_plant(text, path.string());
}

}  // namespace ravencal::physics
