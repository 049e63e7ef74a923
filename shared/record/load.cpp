// SPDX-License-Identifier: Apache-2.0
#include "record/load.hpp"

#include <fmt/format.h>

#include "record/bag_load.hpp"
#include "record/csv_load.hpp"
#include "record/recording_reader.hpp"

namespace ravencal::record {

core::Result<Recording> load_recording(const std::filesystem::path& path,
                                       const LoadOptions& options) {
  const std::string extension = path.extension().string();
  if (extension == ".db")
    return read_recording(path, options.keep, options.threads, options.skip_bad);
  const auto refuse = [&](std::string_view why) {
    return core::Error{core::ErrorCode::kUsage, fmt::format("{}: {}", path.string(), why)};
  };
  if (extension != ".csv" && extension != ".bag")
    return refuse("not a recording: its name must end in .db, .csv or .bag");
  const std::string format = extension.substr(1);
  std::string name = options.profile;
  if (name.empty() && format == "bag") name = "raven2-bag";
  // An exported CSV has a profile beside it that says more than its header can.
  std::error_code unknown;
  const std::filesystem::path beside = profile_beside(path);
  const bool is_plain = format == "csv" && (name.empty() || name == "generic");
  if (is_plain && std::filesystem::is_regular_file(beside, unknown)) name = beside.string();
  if (name.empty()) return refuse("a .csv needs --profile (raven2, generic or a profile file)");
  RAVENCAL_ASSIGN_OR_RETURN(Profile profile, load_profile(name, options.profile_options));
  if (profile.format != format) {
    return refuse(fmt::format("profile {} is for .{} files", profile.name, profile.format));
  }
  if (format == "bag") return load_bag(path, profile, options);
  return load_csv(path, std::move(profile), options);
}

}  // namespace ravencal::record
