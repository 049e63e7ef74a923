// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "record/profile.hpp"

namespace ravencal::record {

/// Parses a profile (FORMATS.md, Profiles) that comes from the file `source`. Unknown keys are
/// errors; errors name file and line.
core::Result<Profile> parse_profile(std::string_view text, const std::string& source);

/// The same for the content of a file. Errors: kIo if it cannot be read, else kData.
core::Result<Profile> read_profile_file(const std::filesystem::path& path);

}  // namespace ravencal::record
