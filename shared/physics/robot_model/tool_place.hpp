// SPDX-License-Identifier: Apache-2.0
//
// Where a robot model has its tool.
#pragma once

#include <filesystem>
#include <string>

#include "core/result.hpp"
#include "physics/plant.hpp"

namespace ravencal::physics {

/// Hangs the plant's payload at a site or body of the model that it was made from. Errors: those of
/// read_robot_file; kUsage: the model has none of that name, or another link carries it than the
/// last one.
core::Status hang_payload_at(const std::string& name, const std::filesystem::path& model,
                             Plant& plant);

}  // namespace ravencal::physics
