// SPDX-License-Identifier: Apache-2.0
//
// Writes a recording (`.db`), either while it happens: SQLite in WAL mode, committed every 50 ms,
// so that a killed or powered-off writer loses at most 100 ms and others can read meanwhile; or
// whole: it appears under its name when it is finished, and until then what had the name stays.
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
  /// Creates `path`, to be written while it happens. Errors: kUsage where a file has the name,
  /// unless `overwrite`, and for an input of the process; kData for channels (check_channels); kIo.
  static core::Result<RecordingWriter> create(const std::filesystem::path& path,
                                              const std::map<std::string, std::string>& meta,
                                              const std::vector<Channel>& channels,
                                              bool overwrite = false);
  /// The same for a recording that appears, or replaces a file, at finish(). Without finish()
  /// nothing stays of it.
  static core::Result<RecordingWriter> create_whole(const std::filesystem::path& path,
                                                    const std::map<std::string, std::string>& meta,
                                                    const std::vector<Channel>& channels,
                                                    bool overwrite = false);
  RecordingWriter(RecordingWriter&&) noexcept;
  RecordingWriter& operator=(RecordingWriter&&) noexcept;
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;
  /// Finishes what is written while it happens; errors are lost, so call finish() where they
  /// matter. Drops what is written whole.
  ~RecordingWriter();

  /// Appends one row; `values` in the channels' own units, shape [channels]; NaN is stored as NULL.
  core::Status append(std::int64_t t_ns, std::span<const double> values);
  core::Status append_event(const Event& event);
  core::Status set_meta(std::string_view key, std::string_view value);
  /// Commits what is pending. Done by itself often enough that no row waits for 100 ms.
  core::Status flush();
  /// Commits, folds the WAL into the file, closes it and, written whole, gives it its name.
  core::Status finish();

 private:
  struct Impl;
  explicit RecordingWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Writes a recording that is known, values in SI units, whole.
core::Status write_recording(const Recording& recording, const std::filesystem::path& path,
                             bool overwrite = false);

}  // namespace ravencal::record
