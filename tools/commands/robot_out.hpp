// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "physics/robot_model/robot_writer.hpp"

namespace ravencal::commands {

/// Writes `plant` into `model` as `out` and, where a callback adds to it, its source beside it.
core::Result<physics::WrittenRobot> write_robot_files(const physics::Plant& plant,
                                                      const std::filesystem::path& model,
                                                      const std::filesystem::path& out);

}  // namespace ravencal::commands
