// SPDX-License-Identifier: Apache-2.0
#include "record/recording_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <system_error>
#include <utility>

#include "core/file_beginnings.hpp"
#include "core/units.hpp"
#include "core/version.hpp"

namespace ravencal::record {
namespace fs = std::filesystem;
namespace {

// One row of 250 values has 2.3 KB: large pages hold several of them, small ones would waste half.
constexpr std::size_t kWideChannels = 64;
constexpr std::array<std::string_view, 4> kReservedNames = {"t_ns", "rowid", "oid", "_rowid_"};

/// The number that SQLite writes as these characters.
constexpr int application_id(std::string_view characters) {
  int id = 0;
  for (const char c : characters) id = 256 * id + c;
  return id;
}

std::string pragmas_of_whole(std::size_t channels) {
  const int page_size = channels > kWideChannels ? 16384 : 4096;
  return fmt::format(
      "PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF; PRAGMA page_size={}; PRAGMA "
      "application_id={};",
      page_size, application_id(core::kRecordingId));
}

// WAL, so that readers never block the writer. synchronous=FULL, because with NORMAL a power cut
// may undo every commit since the last checkpoint; at 20 commits per second the waiting is cheap.
constexpr const char* kLivePragmas = "PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;";

constexpr const char* kSayFinished = "UPDATE meta SET value = '1' WHERE key = 'finished'";

std::string create_tables(std::span<const Channel> channels) {
  std::string sql =
      "CREATE TABLE meta(key TEXT PRIMARY KEY, value TEXT);"
      "CREATE TABLE channel(name TEXT, unit TEXT, role TEXT, joint TEXT);"
      "CREATE TABLE event(t_ns INTEGER, kind TEXT, detail TEXT);"
      "CREATE TABLE sample(t_ns INTEGER";
  for (const Channel& channel : channels) sql += ", " + sqlite::quoted(channel.name) + " REAL";
  return sql + ");";
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(c < 128 ? std::tolower(c) : c); });
  return text;
}

core::Status remove_file(const fs::path& file) {
  std::error_code failure;
  fs::remove(file, failure);
  if (!failure) return {};
  return core::Error{core::ErrorCode::kIo,
                     fmt::format("{}: cannot remove it: {}", file.string(), failure.message())};
}

/// Removes SQLite's files beside a recording, if they exist.
core::Status remove_side_files(const fs::path& path) {
  for (const char* suffix : {"-wal", "-shm", "-journal"}) {
    RAVENCAL_RETURN_IF_ERROR(remove_file(path.string() + suffix));
  }
  return {};
}

}  // namespace

core::Status check_channels(std::span<const Channel> channels, const fs::path& path) {
  const auto refuse = [&](std::string why) {
    return core::Error{core::ErrorCode::kData, fmt::format("{}: {}", path.string(), why)};
  };
  RAVENCAL_RETURN_IF_ERROR(check_channel_count(channels.size(), path));
  std::set<std::string> names(kReservedNames.begin(), kReservedNames.end());
  for (const Channel& channel : channels) {
    const bool usable = !channel.name.empty() && channel.name.find('\0') == std::string::npos;
    if (!usable || !names.insert(lower(channel.name)).second) {
      return refuse(
          fmt::format("a channel cannot be named '{}': the name is empty, reserved "
                      "(t_ns, rowid) or taken already",
                      channel.name));
    }
    if (!core::find_unit(channel.unit)) {
      return refuse(fmt::format("channel {}: unknown unit '{}'", channel.name, channel.unit));
    }
  }
  return {};
}

core::Status check_log_has_recording(const fs::path& path) {
  const fs::path log = path.string() + "-wal";
  std::error_code failure;
  if (fs::exists(path, failure)) return {};
  const std::uintmax_t bytes = fs::file_size(log, failure);
  if (failure || bytes == 0) return {};
  return core::usage_error(fmt::format(
      "{}: holds the last rows of a recording {} that is not here; put that recording back beside "
      "it, remove the log if nobody needs its rows, or choose another name",
      log.string(), path.filename().string()));
}

core::Status settle_recording(const fs::path& path) {
  RAVENCAL_RETURN_IF_ERROR(check_log_has_recording(path));
  // Where one of them is missing there is no row that could be lost.
  std::error_code failure;
  const bool has_rows_in_log =
      fs::exists(path, failure) && fs::exists(path.string() + "-wal", failure);
  sqlite3* handle = nullptr;
  int code = sqlite3_open_v2(path.c_str(), &handle, SQLITE_OPEN_READWRITE, nullptr);
  const sqlite::Database database(handle);
  // A connection in WAL mode keeps others from leaving that mode for as long as it is open.
  if (code == SQLITE_OK) {
    code = sqlite3_exec(handle, "PRAGMA journal_mode=DELETE", nullptr, nullptr, nullptr);
  }
  // What was in the log is in the recording now. Where it is none that can be told, none is lost.
  if (code == SQLITE_OK && has_rows_in_log) {
    (void)sqlite3_db_config(handle, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
    (void)sqlite3_exec(handle, kSayFinished, nullptr, nullptr, nullptr);
  }
  switch (code) {
    case SQLITE_OK:
    case SQLITE_NOTADB:
    case SQLITE_CORRUPT:
      return remove_side_files(path);
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return core::io_error(fmt::format(
          "{}: another process writes or reads it; end that first, or choose another name",
          path.string()));
    default:
      if (!has_rows_in_log) return remove_side_files(path);
      return sqlite::last_error(handle, path,
                                "cannot take in the rows that a killed writer left in its log; "
                                "both stay as they are");
  }
}

RecordingFile::RecordingFile(fs::path path, std::size_t channel_count)
    : path_(std::move(path)), channel_count_(channel_count) {}

core::Result<RecordingFile> RecordingFile::create(const fs::path& path,
                                                  const std::map<std::string, std::string>& meta,
                                                  std::span<const Channel> channels) {
  RecordingFile file(path, channels.size());
  RAVENCAL_RETURN_IF_ERROR(file.open(pragmas_of_whole(channels.size())));
  RAVENCAL_RETURN_IF_ERROR(file.make_tables(meta, channels));
  return file;
}

core::Result<RecordingFile> RecordingFile::open_live(const fs::path& path,
                                                     std::size_t channel_count) {
  RecordingFile file(path, channel_count);
  RAVENCAL_RETURN_IF_ERROR(file.open(kLivePragmas));
  // The log stays unless finish() succeeds: without it the recording counts as one that lost it.
  (void)sqlite3_db_config(file.database_.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  RAVENCAL_RETURN_IF_ERROR(file.prepare());
  return file;
}

core::Status RecordingFile::open(const std::string& pragmas) {
  sqlite3* handle = nullptr;
  const int code =
      sqlite3_open_v2(path_.c_str(), &handle, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr);
  database_.reset(handle);
  if (code != SQLITE_OK) return sqlite::last_error(handle, path_, "cannot create the recording");
  sqlite3_busy_timeout(handle, kBusyTimeoutMs);
  return sqlite::execute(handle, path_, pragmas);
}

core::Status RecordingFile::prepare() {
  sqlite3* const handle = database_.get();
  std::string marks = "?";
  for (std::size_t i = 0; i < channel_count_; ++i) marks += ",?";
  RAVENCAL_ASSIGN_OR_RETURN(
      insert_sample_, sqlite::prepare(handle, path_, "INSERT INTO sample VALUES(" + marks + ")"));
  RAVENCAL_ASSIGN_OR_RETURN(insert_event_,
                            sqlite::prepare(handle, path_, "INSERT INTO event VALUES(?,?,?)"));
  RAVENCAL_ASSIGN_OR_RETURN(
      insert_meta_, sqlite::prepare(handle, path_, "INSERT OR REPLACE INTO meta VALUES(?,?)"));
  return {};
}

core::Status RecordingFile::make_tables(const std::map<std::string, std::string>& meta,
                                        std::span<const Channel> channels) {
  RAVENCAL_RETURN_IF_ERROR(begin());
  RAVENCAL_RETURN_IF_ERROR(sqlite::execute(database_.get(), path_, create_tables(channels)));
  RAVENCAL_RETURN_IF_ERROR(prepare());
  RAVENCAL_RETURN_IF_ERROR(set_meta("software_version", core::kVersion));
  for (const auto& [key, value] : meta) RAVENCAL_RETURN_IF_ERROR(set_meta(key, value));
  RAVENCAL_RETURN_IF_ERROR(set_meta("format_version", kFormatVersion));
  RAVENCAL_RETURN_IF_ERROR(set_meta(kFinishedKey, kIsNotFinished));
  return insert_channels(channels);
}

core::Status RecordingFile::insert_channels(std::span<const Channel> channels) {
  RAVENCAL_ASSIGN_OR_RETURN(
      const sqlite::Statement insert,
      sqlite::prepare(database_.get(), path_, "INSERT INTO channel VALUES(?,?,?,?)"));
  for (const Channel& channel : channels) {
    sqlite::bind_text(insert.get(), 1, channel.name);
    sqlite::bind_text(insert.get(), 2, channel.unit);
    sqlite::bind_text(insert.get(), 3, name_of(channel.role));
    sqlite::bind_text(insert.get(), 4, channel.joint);
    RAVENCAL_RETURN_IF_ERROR(step(insert.get()));
  }
  return {};
}

core::Status RecordingFile::step(sqlite3_stmt* statement) {
  sqlite3_step(statement);
  if (sqlite3_reset(statement) == SQLITE_OK) return {};
  return sqlite::last_error(database_.get(), path_, "cannot write");
}

core::Status RecordingFile::begin() {
  if (in_transaction_) return {};
  RAVENCAL_RETURN_IF_ERROR(sqlite::execute(database_.get(), path_, "BEGIN IMMEDIATE"));
  in_transaction_ = true;
  return {};
}

core::Status RecordingFile::commit() {
  if (!in_transaction_) return {};
  in_transaction_ = false;
  return sqlite::execute(database_.get(), path_, "COMMIT");
}

core::Status RecordingFile::append(std::int64_t t_ns, std::span<const double> values) {
  if (values.size() != channel_count_) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("{}: a row of {} values for {} channels", path_.string(),
                                   values.size(), channel_count_)};
  }
  if (last_t_ns_ && t_ns < *last_t_ns_) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: time runs backwards, from {} ns to {} ns", path_.string(),
                                   *last_t_ns_, t_ns)};
  }
  RAVENCAL_RETURN_IF_ERROR(begin());
  sqlite3_stmt* const row = insert_sample_.get();
  sqlite3_bind_int64(row, 1, t_ns);
  int index = 2;
  for (const double value : values) sqlite3_bind_double(row, index++, value);  // NaN binds NULL
  RAVENCAL_RETURN_IF_ERROR(step(row));
  last_t_ns_ = t_ns;
  return {};
}

core::Status RecordingFile::append_event(const Event& event) {
  RAVENCAL_RETURN_IF_ERROR(begin());
  sqlite3_bind_int64(insert_event_.get(), 1, event.t_ns);
  sqlite::bind_text(insert_event_.get(), 2, event.kind);
  sqlite::bind_text(insert_event_.get(), 3, event.detail);
  return step(insert_event_.get());
}

core::Status RecordingFile::set_meta(std::string_view key, std::string_view value) {
  RAVENCAL_RETURN_IF_ERROR(begin());
  sqlite::bind_text(insert_meta_.get(), 1, key);
  sqlite::bind_text(insert_meta_.get(), 2, value);
  return step(insert_meta_.get());
}

core::Status RecordingFile::finish() {
  RAVENCAL_RETURN_IF_ERROR(begin());
  RAVENCAL_RETURN_IF_ERROR(sqlite::execute(database_.get(), path_, kSayFinished));
  return close();
}

core::Status RecordingFile::close() {
  RAVENCAL_RETURN_IF_ERROR(commit());
  // A live one has its rows in the log, which closing folds into the file.
  RAVENCAL_RETURN_IF_ERROR(sqlite::execute(
      database_.get(), path_, "PRAGMA journal_mode=WAL; PRAGMA wal_checkpoint(TRUNCATE)"));
  (void)sqlite3_db_config(database_.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 0, nullptr);
  *this = RecordingFile(path_, channel_count_);
  return {};
}

}  // namespace ravencal::record
