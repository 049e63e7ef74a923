// SPDX-License-Identifier: Apache-2.0
//
// Models that an MJCF document (MuJoCo 3) attaches to its own bodies.
#pragma once

#include <filesystem>

#include "physics/robot_model/robot_document.hpp"

namespace ravencal::physics {

/// Puts the bodies of other models, with their classes and what drives and couples them, in the
/// place of `attach`; names and classes get its prefix. `path`: of the document; `depth`: how many
/// models this one is attached to. Errors: those of read_robot_document for the other model; kData,
/// with the element's place, where there is no such model or body, or where the two measure angles
/// or have defaults that cannot stand in one document.
core::Status attach_models(RobotDocument& document, const std::filesystem::path& path, int depth);

}  // namespace ravencal::physics
