// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "record/profile.hpp"
#include "record/recording.hpp"

namespace ravencal::record {

/// Writes a recording as the CSV that `profile` describes, values in the profile's units with all
/// their digits (a lost value is `nan`); importing it again gives the same SI values. `raven2`
/// writes all 252 columns, those that import skips too; `generic` also writes profile_beside(path).
/// Errors: a channel of the profile that the recording lacks; the disk. Nothing is left behind on
/// failure.
core::Status export_csv(const Recording& recording, const Profile& profile,
                        const std::filesystem::path& path);

}  // namespace ravencal::record
