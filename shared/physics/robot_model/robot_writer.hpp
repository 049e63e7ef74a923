// SPDX-License-Identifier: Apache-2.0
//
// The way back: a plant written into the robot model that it was made from.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "physics/plant.hpp"

namespace ravencal::physics {

struct WrittenRobot {
  std::string text;                        ///< of the model
  std::vector<std::string> changed;        ///< one each
  std::vector<std::string> not_expressed;  ///< what no model of this format says, one each
  std::string callback;                    ///< C++ source of what a callback can add; else empty
};

/// The model at `model` (.xml: MJCF, .urdf) with the numbers of `plant`, to be written to `out`.
/// Names, comments and order stay; only what differs from the plant that the model itself gives is
/// changed, and files that it includes stand in it. The text was read again and gives the plant.
/// Errors: those of read_robot_file; kData where the plant has other joints or frames than the
/// model, or where the document has parts that the installed library does not read.
core::Result<WrittenRobot> write_robot(const Plant& plant, const std::filesystem::path& model,
                                       const std::filesystem::path& out);

/// Writes the model as `out` and, where a callback adds to it, its source beside it.
core::Status save_robot(const WrittenRobot& written, const std::filesystem::path& out);

/// True of a file that load_plant takes for a robot model.
bool is_robot_model(const std::filesystem::path& path);
/// Where the callback's source of a model goes: beside it.
std::filesystem::path callback_path(const std::filesystem::path& out);

}  // namespace ravencal::physics
