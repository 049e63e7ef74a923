// SPDX-License-Identifier: Apache-2.0
//
// What a diagnosis leaves behind where its plant was read from a robot model of others.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "core/result.hpp"
#include "diagnose/findings/findings.hpp"
#include "physics/robot_model/robot_writer.hpp"

namespace ravencal::diagnose {

/// The improved plant in the user's own model.
struct ImprovedRobot {
  std::filesystem::path path;
  physics::WrittenRobot written;
};

/// All that write_with_robot may write.
std::vector<std::filesystem::path> files_of(const std::filesystem::path& plant_file,
                                            const std::filesystem::path& folder);

/// write_report, which writes a plant that stays as it was byte for byte, and, where `plant_file`
/// is a robot model, robot_improved.xml or .urdf beside it; the verdict's text then says what that
/// is. A model that cannot be made leaves the report whole and stands in it with the reason.
/// Errors: something cannot be written (kIo).
core::Result<std::optional<ImprovedRobot>> write_with_robot(Report& report,
                                                            const std::filesystem::path& plant_file,
                                                            const std::filesystem::path& folder);

}  // namespace ravencal::diagnose
