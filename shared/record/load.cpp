// SPDX-License-Identifier: Apache-2.0
#include "record/load.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "record/bag_load.hpp"
#include "record/csv_load.hpp"
#include "record/recording_reader.hpp"

namespace ravencal::record {

std::string profile_name(const std::filesystem::path& path, const LoadOptions& options) {
  const bool is_bag = path.extension() == ".bag";
  // An exported CSV has a profile beside it that says more than its header can.
  std::error_code unknown;
  const std::filesystem::path beside = profile_beside(path);
  const bool is_plain = !is_bag && (options.profile.empty() || options.profile == "generic");
  if (is_plain && std::filesystem::is_regular_file(beside, unknown)) return beside.string();
  return is_bag && options.profile.empty() ? "raven2-bag" : options.profile;
}

core::Result<Profile> profile_for(const std::filesystem::path& path, const LoadOptions& options) {
  const auto refuse = [&](std::string_view why) {
    return core::usage_error(fmt::format("{}: {}", path.string(), why));
  };
  const std::string name = profile_name(path, options);
  if (name.empty()) {
    return refuse(
        fmt::format("a {} needs --profile (raven2, generic or a profile file); "
                    "`ravencal info` lists its columns",
                    path.extension().string()));
  }
  RAVENCAL_ASSIGN_OR_RETURN(Profile profile, load_profile(name, options.profile_options));
  const bool is_bag = path.extension() == ".bag";
  if ((profile.format == "bag") != is_bag) {
    return refuse(fmt::format("profile {} is for {}", profile.name,
                              is_bag ? "tables of named columns, such as .csv" : ".bag files"));
  }
  return profile;
}

namespace {

/// No quantity in SI units, count or time is as large. Float32's largest, by which recorders mark
/// what they do not know, is beyond it.
constexpr double kLargestValue = 1e30;

/// Infinities included.
core::Status check_values(Recording& recording, bool skip_bad) {
  for (Eigen::Index c = 0; c < recording.samples.cols(); ++c) {
    auto column = recording.samples.col(c);
    if (!(column.array().abs() > kLargestValue).any()) continue;
    for (Eigen::Index row = 0; row < column.size(); ++row) {
      if (!(std::abs(column[row]) > kLargestValue)) continue;
      const std::string why =
          fmt::format("{} is {}, which no sensor measures",
                      recording.channels[static_cast<std::size_t>(c)].name, column[row]);
      if (!skip_bad) {
        return core::data_error(fmt::format("{}: row {}: {}; use --skip-bad to read it as missing",
                                            recording.source, row + 1, why));
      }
      recording.events.push_back({recording.t_ns[static_cast<std::size_t>(row)], "drop",
                                  fmt::format("row {}: {}", row + 1, why)});
      column[row] = std::numeric_limits<double>::quiet_NaN();
    }
  }
  return {};
}

core::Result<Recording> load_whole(const std::filesystem::path& path, const LoadOptions& options) {
  const std::string extension = path.extension().string();
  if (extension == ".db")
    return read_recording(path, options.keep, options.threads, options.skip_bad);
  if (extension != ".csv" && extension != ".bag") {
    return core::usage_error(
        fmt::format("{}: not a recording: its name must end in .db, .csv or .bag", path.string()));
  }
  RAVENCAL_ASSIGN_OR_RETURN(Profile profile, profile_for(path, options));
  if (extension == ".bag") return load_bag(path, profile, options);
  return load_csv(path, std::move(profile), options);
}

}  // namespace

core::Result<Recording> load_recording(const std::filesystem::path& path,
                                       const LoadOptions& options) {
  RAVENCAL_ASSIGN_OR_RETURN(Recording recording, load_whole(path, options));
  RAVENCAL_RETURN_IF_ERROR(finish_reading(recording, options));
  return recording;
}

core::Status finish_reading(Recording& recording, const LoadOptions& options) {
  RAVENCAL_RETURN_IF_ERROR(check_values(recording, options.skip_bad));
  return cut_to(recording, options.range);
}

}  // namespace ravencal::record
