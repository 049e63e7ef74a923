// SPDX-License-Identifier: Apache-2.0
//
// Recordings from every kind of file that ravencal reads.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "record/load.hpp"
#include "record/recording.hpp"

namespace ravencal::exchange {

/// Reads a recording: what record::load_recording reads, ravencal's own exports .h5 and .mat as
/// they are, and foreign tables (table_file.hpp) through a profile of format "csv". Errors name
/// file, column, row and value.
core::Result<record::Recording> load_recording(const std::filesystem::path& path,
                                               const record::LoadOptions& options);

/// Reads them all; the error is that of the first that cannot be read.
core::Result<std::vector<record::Recording>> load_recordings(const std::vector<std::string>& paths,
                                                             const record::LoadOptions& options);

/// The same; none if the file is a table and nothing says which column is which channel.
core::Result<std::optional<record::Recording>> load_if_described(
    const std::filesystem::path& path, const record::LoadOptions& options);

}  // namespace ravencal::exchange
