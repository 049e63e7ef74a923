// SPDX-License-Identifier: Apache-2.0
#include "commands/robot_out.hpp"

#include "core/whole_file.hpp"

namespace ravencal::commands {

core::Result<physics::WrittenRobot> write_robot_files(const physics::Plant& plant,
                                                      const std::filesystem::path& model,
                                                      const std::filesystem::path& out) {
  RAVENCAL_ASSIGN_OR_RETURN(physics::WrittenRobot written, physics::write_robot(plant, model, out));
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(out, written.text));
  if (!written.callback.empty())
    RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(physics::callback_path(out), written.callback));
  return written;
}

}  // namespace ravencal::commands
