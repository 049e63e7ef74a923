// SPDX-License-Identifier: Apache-2.0
//
// The tables of a recording and one open, writable recording file. Private to record/: others use
// RecordingWriter (while it happens) or write_recording (a whole recording at once).
// Not thread-safe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "record/channel.hpp"
#include "record/recording.hpp"
#include "record/sqlite.hpp"

namespace ravencal::record {

/// Value of meta's `format_version`; a reader refuses any other.
inline constexpr std::string_view kFormatVersion = "1";

/// Key in meta: "0" until the writer has finished, then "1". Recordings of earlier versions have
/// none.
inline constexpr const char* kFinishedKey = "finished";
inline constexpr std::string_view kIsNotFinished = "0";

/// How long a reader or a writer waits for another that holds the file.
inline constexpr int kBusyTimeoutMs = 2000;

class RecordingFile {
 public:
  /// Creates the tables in a file that is empty or not there, and that nobody else sees before
  /// close(): without journal and without waiting for the disk.
  static core::Result<RecordingFile> create(const std::filesystem::path& path,
                                            const std::map<std::string, std::string>& meta,
                                            std::span<const Channel> channels);
  /// Goes on with one that create() made and close() closed, for others to read meanwhile. What is
  /// written stays in an open transaction until commit(), and from then on survives a kill and a
  /// power cut.
  static core::Result<RecordingFile> open_live(const std::filesystem::path& path,
                                               std::size_t channel_count);

  core::Status append(std::int64_t t_ns, std::span<const double> values);
  core::Status append_event(const Event& event);
  core::Status set_meta(std::string_view key, std::string_view value);
  core::Status commit();
  /// Commits, leaves one file in WAL mode without side files, and closes it.
  core::Status close();
  /// The same once all is written: from then on the recording says that it is whole.
  core::Status finish();

 private:
  RecordingFile(std::filesystem::path path, std::size_t channel_count);
  core::Status open(const std::string& pragmas);
  core::Status make_tables(const std::map<std::string, std::string>& meta,
                           std::span<const Channel> channels);
  core::Status prepare();
  core::Status insert_channels(std::span<const Channel> channels);
  core::Status begin();
  core::Status step(sqlite3_stmt* statement);

  std::filesystem::path path_;
  std::size_t channel_count_;
  sqlite::Database database_;  // closed after its statements, which are declared below
  sqlite::Statement insert_sample_;
  sqlite::Statement insert_event_;
  sqlite::Statement insert_meta_;
  bool in_transaction_ = false;
  std::optional<std::int64_t> last_t_ns_;
};

/// Why a recording cannot have these channels, if so: names unique without regard to case (they
/// become SQL columns) and not reserved, units known, at most
/// kMostChannels.
core::Status check_channels(std::span<const Channel> channels, const std::filesystem::path& path);

/// kUsage where `path` is not there but a log (`-wal`) of that name is: of a recording that was
/// moved without it, whose last rows only the log has. Nothing may remove it, and no new recording
/// of the name can be beside it.
core::Status check_log_has_recording(const std::filesystem::path& path);

/// Before another file takes the recording's name: takes the rows that a killed writer left in
/// SQLite's log into the recording itself, so that it is whole until then, and removes the log,
/// whose rows SQLite would read instead of the new ones. kIo where another process has it open or
/// where the rows cannot be taken in (a full disk), kUsage where check_log_has_recording() refuses:
/// all files then stay as they are.
core::Status settle_recording(const std::filesystem::path& path);

}  // namespace ravencal::record
