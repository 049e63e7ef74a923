// SPDX-License-Identifier: Apache-2.0
//
// Recordings from every kind of file that ravencal reads.
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "record/load.hpp"
#include "record/recording.hpp"

namespace ravencal::exchange {

/// Reads a recording: what record::load_recording reads, and foreign tables (table_file.hpp)
/// through a profile of format "csv". Errors name file, column, row and value.
core::Result<record::Recording> load_recording(const std::filesystem::path& path,
                                               const record::LoadOptions& options);

}  // namespace ravencal::exchange
