// SPDX-License-Identifier: Apache-2.0
//
// Finds and starts `ravencal-ros`, the program with the parts that need ROS 1.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace ravencal::commands {

/// Path of the running program.
std::filesystem::path own_path();

/// Beside the running program, else in ../libexec/ravencal or ../lib/ravencal.
std::optional<std::filesystem::path> find_ros_program();

/// Becomes `ravencal-ros COMMAND ...` with the arguments that this process was started with;
/// returns only if that fails.
core::Status become_ros_program(const std::string& command);

}  // namespace ravencal::commands
