// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "physics/robot_model/robot_writer.hpp"

namespace ravencal::commands {

/// Says what was written, what it lacks, and how the callback is built.
void print_model(const physics::WrittenRobot& written, const std::filesystem::path& out);

}  // namespace ravencal::commands
