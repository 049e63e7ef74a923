// SPDX-License-Identifier: Apache-2.0
//
// SQLite files of rosbag2, as ROS 2 records them up to Humble.
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "record/load.hpp"
#include "record/table.hpp"

namespace ravencal::exchange {

/// The joints of all topics (joint_states.hpp). Errors: kIo; kData: no such file, a damaged
/// one, compressed messages.
core::Result<record::Table> read_rosbag2(const std::filesystem::path& path,
                                         const record::LoadOptions& options);

}  // namespace ravencal::exchange
