// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "physics/robot_model/robot_writer.hpp"

namespace ravencal::commands {

/// Writes the model as `out` and, where a callback adds to it, its source beside it.
core::Status save_robot(const physics::WrittenRobot& written, const std::filesystem::path& out);
/// Says what was written, what it lacks, and how the callback is built.
void print_model(const physics::WrittenRobot& written, const std::filesystem::path& out);

}  // namespace ravencal::commands
