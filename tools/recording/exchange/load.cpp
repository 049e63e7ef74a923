// SPDX-License-Identifier: Apache-2.0
#include "exchange/load.hpp"

#include <fmt/format.h>

#include "core/known_words.hpp"
#include "exchange/hdf5_read.hpp"
#include "exchange/mat_read.hpp"
#include "exchange/table_file.hpp"
#include "record/csv_load.hpp"

namespace ravencal::exchange {
namespace {

using FoundRecording = std::optional<record::Recording>;

/// What `ravencal export` wrote says itself which channel is what.
core::Result<FoundRecording> read_export(const std::filesystem::path& path) {
  if (path.extension() == ".h5") return read_exported_hdf5(path);
  if (path.extension() == ".mat") return read_exported_mat(path);
  return FoundRecording();
}

core::Result<record::Recording> load_through_profile(const std::filesystem::path& path,
                                                     const record::LoadOptions& options) {
  RAVENCAL_ASSIGN_OR_RETURN(record::Profile profile, record::profile_for(path, options));
  if (path.extension() == ".csv") return record::load_csv(path, std::move(profile), options);
  RAVENCAL_ASSIGN_OR_RETURN(const record::Table table, read_table(path, options));
  return record::load_table(table, std::move(profile), options);
}

core::Error no_recording(const std::filesystem::path& path) {
  std::error_code unknown;
  const std::string extension = path.extension().string();
  if (std::filesystem::is_directory(path, unknown)) {
    return core::usage_error(fmt::format(
        "{}: is a folder; of a bag of ROS 2 give the .mcap or .db3 in it", path.string()));
  }
  if (extension == ".zstd") {
    return core::usage_error(fmt::format(
        "{}: is compressed as a whole; `zstd -d` makes a file that can be read", path.string()));
  }
  std::vector<std::string> known = table_extensions();
  known.insert(known.end(), {".db", ".bag"});
  return core::usage_error(fmt::format("{}: not a recording: no recording ends in '{}'{}",
                                       path.string(), extension,
                                       core::instead_of(extension, known)));
}

}  // namespace

core::Result<FoundRecording> load_if_described(const std::filesystem::path& path,
                                               const record::LoadOptions& options) {
  const std::string extension = path.extension().string();
  if (extension == ".db" || extension == ".bag") {
    RAVENCAL_ASSIGN_OR_RETURN(record::Recording read, record::load_recording(path, options));
    return FoundRecording(std::move(read));
  }
  if (!is_table(path)) return no_recording(path);
  FoundRecording recording;
  if (record::profile_name(path, options).empty()) {
    RAVENCAL_ASSIGN_OR_RETURN(recording, read_export(path));
  } else {
    RAVENCAL_ASSIGN_OR_RETURN(recording, load_through_profile(path, options));
  }
  if (recording) RAVENCAL_RETURN_IF_ERROR(record::finish_reading(*recording, options));
  return recording;
}

core::Result<record::Recording> load_recording(const std::filesystem::path& path,
                                               const record::LoadOptions& options) {
  RAVENCAL_ASSIGN_OR_RETURN(FoundRecording recording, load_if_described(path, options));
  if (recording) return std::move(*recording);
  return record::profile_for(path, options).error();
}

core::Result<std::vector<record::Recording>> load_recordings(const std::vector<std::string>& paths,
                                                             const record::LoadOptions& options) {
  std::vector<record::Recording> recordings;
  for (const std::string& path : paths) {
    RAVENCAL_ASSIGN_OR_RETURN(record::Recording recording, exchange::load_recording(path, options));
    recordings.push_back(std::move(recording));
  }
  return recordings;
}

}  // namespace ravencal::exchange
