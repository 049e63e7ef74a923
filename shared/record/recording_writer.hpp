// SPDX-License-Identifier: Apache-2.0
//
// Writes a recording (`.db`) while it happens: SQLite in WAL mode, committed every 50 ms, so
// that a killed or powered-off writer loses at most 100 ms and others can read meanwhile.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "record/channel.hpp"
#include "record/recording.hpp"

namespace ravencal::record {

/// Not thread-safe: one thread owns a writer. Not for real-time threads.
class RecordingWriter {
 public:
  /// Creates `path` (an existing file is refused unless `overwrite`).
  static core::Result<RecordingWriter> create(const std::filesystem::path& path,
                                              const std::map<std::string, std::string>& meta,
                                              const std::vector<Channel>& channels,
                                              bool overwrite = false);
  RecordingWriter(RecordingWriter&&) noexcept;
  RecordingWriter& operator=(RecordingWriter&&) noexcept;
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;
  ~RecordingWriter();  ///< finishes; errors are lost, so call finish() where they matter

  /// Appends one row; `values` in the channels' own units, shape [channels]; NaN is stored as NULL.
  core::Status append(std::int64_t t_ns, std::span<const double> values);
  core::Status append_event(const Event& event);
  core::Status set_meta(std::string_view key, std::string_view value);
  /// Commits what is pending. Done by itself often enough that no row waits for 100 ms.
  core::Status flush();
  /// Commits, folds the WAL into the file and closes it.
  core::Status finish();

 private:
  struct Impl;
  explicit RecordingWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Writes a whole recording, values in SI units.
core::Status write_recording(const Recording& recording, const std::filesystem::path& path,
                             bool overwrite = false);

}  // namespace ravencal::record
