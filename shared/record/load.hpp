// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "core/result.hpp"
#include "record/profile.hpp"
#include "record/recording.hpp"
#include "record/recording_reader.hpp"
#include "record/time_range.hpp"

namespace ravencal::record {

struct LoadOptions {
  std::string profile;  ///< name or path; required for .csv, raven2-bag if absent for .bag,
                        ///< ignored for .db
  TimeRange range;      ///< rows and events outside are dropped once the file is read
  ProfileOptions profile_options;
  bool skip_bad = false;    ///< drop unreadable rows, counted in events, instead of refusing
  ChannelFilter keep = {};  ///< .db only: other channels are not read
  unsigned threads = 0;     ///< 0 = all cores
};

/// Name or path of the profile that reads a file: that of the options, FILE.toml beside a table
/// (instead of none or of generic), raven2-bag for a bag. Empty if there is none.
std::string profile_name(const std::filesystem::path& path, const LoadOptions& options);

/// That profile. Errors: there is none, or it is for another kind of file.
core::Result<Profile> profile_for(const std::filesystem::path& path, const LoadOptions& options);

/// Reads a recording: `.db` as it is, `.csv` and `.bag` through a profile. Errors name file, line,
/// column and value: `run3.csv:1842: column 14 (jpos shoulder): 'nan' is not a number; use
/// --skip-bad ...`.
core::Result<Recording> load_recording(const std::filesystem::path& path,
                                       const LoadOptions& options);

/// What every recording passes once its file is read: values beyond 1e30 are an error, or missing
/// where bad rows are skipped, and rows outside the range are dropped.
core::Status finish_reading(Recording& recording, const LoadOptions& options);

}  // namespace ravencal::record
