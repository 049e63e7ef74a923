// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "record/profile.hpp"

namespace ravencal::record {

/// Reads a profile file (FORMATS.md, Profiles). Unknown keys are errors; errors name file and line.
core::Result<Profile> read_profile_file(const std::filesystem::path& path);

}  // namespace ravencal::record
