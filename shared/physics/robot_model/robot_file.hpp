// SPDX-License-Identifier: Apache-2.0
//
// Robot models of others: MJCF and URDF files, as the installed libmujoco compiles them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "physics/mujoco_model.hpp"
#include "physics/robot_model/model_words.hpp"

namespace ravencal::physics {

struct RobotFile {
  ModelPointer model;
  ModelWords words;
  std::vector<std::string> notes;  ///< what was left out of it to be read, one each
};

/// Reads the file, with the files that it includes. What only pictures and contacts need (meshes,
/// textures, height fields) is left out, a floating base is held, and attributes and elements that
/// the library does not know are removed from a copy in memory. Errors: kIo; kData, with the place,
/// where such an element holds a part of the robot, and with the library's reason where the rest is
/// no model.
core::Result<RobotFile> read_robot_file(const std::filesystem::path& path);
/// The same of a document that stands in memory: it loses what is left out. `path` stands in
/// messages.
core::Result<RobotFile> compile_robot(RobotDocument& document, const std::filesystem::path& path);

}  // namespace ravencal::physics
