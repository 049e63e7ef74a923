// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "record/load.hpp"
#include "record/profile.hpp"
#include "record/recording.hpp"
#include "record/table.hpp"

namespace ravencal::record {

/// Reads a CSV file through a profile. Uses `skip_bad` and `threads` of the options.
core::Result<Recording> load_csv(const std::filesystem::path& path, Profile profile,
                                 const LoadOptions& options);

/// Every column of a CSV file. A first line of numbers alone is no header. A column with a field
/// that is neither a number nor empty has texts. Uses `skip_bad` and `threads` of the options.
/// Errors: kIo; kData: a row of another number of columns.
core::Result<Table> read_csv_table(const std::filesystem::path& path, const LoadOptions& options);

}  // namespace ravencal::record
