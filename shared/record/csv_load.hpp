// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "record/load.hpp"
#include "record/profile.hpp"
#include "record/recording.hpp"

namespace ravencal::record {

/// Reads a CSV file through a profile. Uses `skip_bad` and `threads` of the options.
core::Result<Recording> load_csv(const std::filesystem::path& path, Profile profile,
                                 const LoadOptions& options);

}  // namespace ravencal::record
