// SPDX-License-Identifier: Apache-2.0
//
// MCAP files (mcap.dev/spec), as ROS 2 records them by default.
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "record/load.hpp"
#include "record/table.hpp"

namespace ravencal::exchange {

/// The joints of all topics (joint_states.hpp). Errors: kIo; kData: no MCAP file; one that is
/// damaged or ends without its footer, as when the recorder was killed, with the byte; with
/// skip_bad what can be read is read.
core::Result<record::Table> read_mcap(const std::filesystem::path& path,
                                      const record::LoadOptions& options);

}  // namespace ravencal::exchange
