// SPDX-License-Identifier: Apache-2.0
#include "record/recording_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <limits>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "core/known_words.hpp"
#include "core/side_by_side.hpp"
#include "core/units.hpp"
#include "record/log_check.hpp"
#include "record/recording_file.hpp"
#include "record/sqlite.hpp"

namespace ravencal::record {
namespace fs = std::filesystem;
namespace {

/// Fewer are read before a thread has started.
constexpr Eigen::Index kLeastRowsPerThread = 5000;

/// One read transaction, so that all tables are seen at one moment.
class Reader {
 public:
  explicit Reader(const fs::path& path, ChannelFilter keep = {})
      : path_(path), keep_(std::move(keep)) {}
  core::Result<Recording> read(unsigned threads, bool skip_bad);
  core::Result<std::vector<Event>> read_events_only();

 private:
  core::Status open();
  core::Result<sqlite::Database> connect();
  core::Status read_meta();
  core::Status read_channels();
  core::Status read_events();
  core::Status read_samples(unsigned threads);
  core::Status check_log(bool skip_bad);
  core::Status check_end(bool skip_bad);
  core::Status give_up_rows(const std::string& why, bool skip_bad);
  bool read_in_parts(unsigned threads);
  core::Result<Eigen::Index> read_rows(sqlite3* database, const std::string& which,
                                       Eigen::Index begin, Eigen::Index end);
  core::Status read_row(sqlite3_stmt* row, Eigen::Index r, bool first);
  core::Result<Eigen::Index> count_rows();
  core::Result<Eigen::Index> most_rows();
  core::Error damaged(std::string why) const {
    return {core::ErrorCode::kData, fmt::format("{}: {}", path_.string(), why)};
  }
  core::Result<sqlite::Statement> prepare(const std::string& sql) const {
    return sqlite::prepare(database_.get(), path_, sql);
  }
  template <typename OnRow>
  core::Status for_each(sqlite3_stmt* statement, OnRow&& on_row) const;

  const fs::path& path_;
  ChannelFilter keep_;
  bool written_now_ = false;
  bool is_finished_ = true;
  std::size_t columns_ = 1;   ///< of a sample: t_ns and every channel, kept or not
  std::uintmax_t bytes_ = 0;  ///< of the file and of its log
  std::atomic<std::int64_t> operations_left_{0};
  sqlite::Database database_;
  Recording recording_;
  std::vector<double> to_si_;
};

template <typename OnRow>
core::Status Reader::for_each(sqlite3_stmt* statement, OnRow&& on_row) const {
  int code = SQLITE_ROW;
  while ((code = sqlite3_step(statement)) == SQLITE_ROW) {
    RAVENCAL_RETURN_IF_ERROR(on_row(statement));
  }
  if (code == SQLITE_DONE) return {};
  return sqlite::last_error(sqlite3_db_handle(statement), path_, "cannot read");
}

// A path as a SQLite URI: these characters mean something there.
std::string uri_of(const fs::path& path) {
  std::string uri = "file:";
  for (const char c : fs::absolute(path).string()) {
    if (c == '%' || c == '?' || c == '#') {
      uri += fmt::format("%{:02x}", static_cast<unsigned char>(c));
    } else {
      uri += c;
    }
  }
  return uri;
}

core::Result<sqlite::Database> Reader::connect() {
  // Without a WAL beside it nobody writes the recording. SQLite then needs neither locks nor files
  // of its own, so that reading works on a read-only disk and leaves nothing behind.
  const std::string uri = uri_of(path_) + (written_now_ ? "" : "?immutable=1");
  // One thread uses this connection: SQLite's own locks around every value would cost half the
  // time.
  sqlite3* handle = nullptr;
  int code = sqlite3_open_v2(uri.c_str(), &handle,
                             SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
  sqlite::Database database(handle);
  if (code == SQLITE_OK) {
    sqlite3_busy_timeout(handle, kBusyTimeoutMs);
    sqlite::distrust(handle, operations_left_);
    code = sqlite3_exec(handle, "BEGIN; SELECT count(*) FROM sqlite_schema", nullptr, nullptr,
                        nullptr);
  }
  if (code == SQLITE_OK) return database;
  return sqlite::last_error(handle, path_, "cannot open");
}

core::Status Reader::open() {
  std::error_code failure;
  if (!fs::is_regular_file(path_, failure)) {
    return core::Error{core::ErrorCode::kIo, fmt::format("{}: no such file", path_.string())};
  }
  const fs::path log = path_.string() + "-wal";
  written_now_ = fs::exists(log, failure);
  for (const fs::path& file : {path_, log}) {
    const std::uintmax_t size = fs::file_size(file, failure);
    if (!failure) bytes_ += size;
  }
  operations_left_ = sqlite::operations_for(bytes_);
  RAVENCAL_ASSIGN_OR_RETURN(database_, connect());
  return sqlite::check_schema(database_.get(), path_);
}

core::Status Reader::read_meta() {
  RAVENCAL_ASSIGN_OR_RETURN(const sqlite::Statement rows, prepare("SELECT key, value FROM meta"));
  RAVENCAL_RETURN_IF_ERROR(for_each(rows.get(), [this](sqlite3_stmt* row) {
    recording_.meta[sqlite::text_of(row, 0)] = sqlite::text_of(row, 1);
    return core::Status();
  }));
  if (const auto mark = recording_.meta.extract(kFinishedKey); !mark.empty())
    is_finished_ = mark.mapped() != kIsNotFinished;
  const std::string& version = recording_.meta["format_version"];
  if (version == kFormatVersion) return {};
  return damaged(
      fmt::format("recording format '{}', but this program reads {}; use the ravencal "
                  "that wrote it",
                  version, kFormatVersion));
}

core::Status Reader::read_channels() {
  RAVENCAL_ASSIGN_OR_RETURN(const sqlite::Statement rows,
                            prepare("SELECT name, unit, role, joint FROM channel ORDER BY rowid"));
  std::vector<Channel> all;
  RAVENCAL_RETURN_IF_ERROR(for_each(rows.get(), [&](sqlite3_stmt* row) -> core::Status {
    Channel channel{sqlite::text_of(row, 0), sqlite::text_of(row, 1), Role::kFeature,
                    sqlite::text_of(row, 3)};
    const std::string role_name = sqlite::text_of(row, 2);
    const auto role = role_from(role_name);
    const auto unit = core::find_unit(channel.unit);
    if (!role || !unit) {
      const std::string& word = role ? channel.unit : role_name;
      return damaged(fmt::format("channel {}: unknown {} '{}'{}", channel.name,
                                 role ? "unit" : "role", word,
                                 core::instead_of(word, role ? core::unit_names() : role_names())));
    }
    ++columns_;
    // Simulated recordings from before the role was there.
    const bool is_reading = *role == Role::kFeature && channel.name.starts_with("truth_counts.");
    channel.role = is_reading ? Role::kTruthReading : *role;
    channel.unit = unit->si_name;
    all.push_back(channel);
    if (keep_ && !keep_(channel)) return {};
    to_si_.push_back(unit->to_si);
    recording_.channels.push_back(std::move(channel));
    return {};
  }));
  return check_channels(all, path_);
}

core::Status Reader::read_events() {
  RAVENCAL_ASSIGN_OR_RETURN(const sqlite::Statement rows,
                            prepare("SELECT t_ns, kind, detail FROM event ORDER BY rowid"));
  return for_each(rows.get(), [this](sqlite3_stmt* row) {
    recording_.events.push_back(
        {sqlite3_column_int64(row, 0), sqlite::text_of(row, 1), sqlite::text_of(row, 2)});
    return core::Status();
  });
}

core::Result<Eigen::Index> Reader::count_rows() {
  RAVENCAL_ASSIGN_OR_RETURN(const sqlite::Statement rows, prepare("SELECT count(*) FROM sample"));
  if (sqlite3_step(rows.get()) != SQLITE_ROW) {
    return sqlite::last_error(database_.get(), path_, "cannot read");
  }
  return static_cast<Eigen::Index>(sqlite3_column_int64(rows.get(), 0));
}

// Counting reads the whole file. Writers number rows from 1 on, so that the last number says as
// much, unless it is one that a file of this size has no room for: a row has a byte per column.
core::Result<Eigen::Index> Reader::most_rows() {
  RAVENCAL_ASSIGN_OR_RETURN(
      const sqlite::Statement ends,
      prepare("SELECT (SELECT min(rowid) FROM sample), (SELECT max(rowid) FROM sample)"));
  if (sqlite3_step(ends.get()) != SQLITE_ROW) {
    return sqlite::last_error(database_.get(), path_, "cannot read");
  }
  const std::int64_t first = sqlite3_column_int64(ends.get(), 0);
  const std::int64_t last = sqlite3_column_int64(ends.get(), 1);
  const auto columns = static_cast<std::uintmax_t>(recording_.channels.size()) + 1;
  const auto room = static_cast<std::int64_t>(bytes_ / columns);
  if (first >= 1 && last >= first && last <= room) return static_cast<Eigen::Index>(last);
  RAVENCAL_ASSIGN_OR_RETURN(const Eigen::Index rows, count_rows());
  if (rows <= room) return rows;
  return damaged(fmt::format("{} samples of {} channels are more than its {} bytes can hold", rows,
                             recording_.channels.size(), bytes_));
}

core::Status Reader::read_samples(unsigned threads) {
  RAVENCAL_ASSIGN_OR_RETURN(const Eigen::Index row_count, most_rows());
  recording_.samples.resize(row_count, static_cast<Eigen::Index>(recording_.channels.size()));
  recording_.t_ns.resize(static_cast<std::size_t>(row_count));
  if (read_in_parts(threads)) return {};
  RAVENCAL_ASSIGN_OR_RETURN(const Eigen::Index rows, read_rows(database_.get(), "", 0, row_count));
  recording_.t_ns.resize(static_cast<std::size_t>(rows));
  if (rows < row_count) recording_.samples.conservativeResize(rows, Eigen::NoChange);
  return {};
}

// Reads the parts of a recording side by side. False, and it has to be read from end to end, if it
// is short or being written, so that other connections would see another moment of it, or if a part
// has gaps or damage, of which only a reading in order says where they are.
bool Reader::read_in_parts(unsigned threads) {
  const Eigen::Index rows = recording_.samples.rows();
  const Eigen::Index parts = std::min<Eigen::Index>(threads, rows / kLeastRowsPerThread);
  if (written_now_ || parts < 2) return false;
  std::vector<char> whole(static_cast<std::size_t>(parts), 0);
  std::atomic<Eigen::Index> next{0};
  core::side_by_side(static_cast<std::size_t>(parts), [&] {
    for (Eigen::Index part = next++; part < parts; part = next++) {
      const Eigen::Index begin = rows * part / parts;
      const Eigen::Index end = rows * (part + 1) / parts;
      const auto database = connect();
      if (!database) return;
      const std::string which = fmt::format(" WHERE rowid BETWEEN {} AND {}", begin + 1, end);
      const auto read = read_rows(database.value().get(), which, begin, end);
      whole[static_cast<std::size_t>(part)] = read && read.value() == end - begin ? 1 : 0;
    }
  });
  for (Eigen::Index part = 1; part < parts; ++part) {
    const auto seam = static_cast<std::size_t>(rows * part / parts);
    if (recording_.t_ns[seam] < recording_.t_ns[seam - 1]) return false;
  }
  return std::all_of(whole.begin(), whole.end(), [](char one) { return one != 0; });
}

/// How many rows there were; they go to [begin, end).
core::Result<Eigen::Index> Reader::read_rows(sqlite3* database, const std::string& which,
                                             Eigen::Index begin, Eigen::Index end) {
  std::string sql = "SELECT t_ns";
  for (const Channel& channel : recording_.channels) sql += ", " + sqlite::quoted(channel.name);
  sql += " FROM sample" + which + " ORDER BY rowid";
  RAVENCAL_ASSIGN_OR_RETURN(const sqlite::Statement rows, sqlite::prepare(database, path_, sql));
  Eigen::Index r = begin;
  RAVENCAL_RETURN_IF_ERROR(for_each(rows.get(), [&](sqlite3_stmt* row) -> core::Status {
    if (r == end) return damaged("it has more samples than their numbers leave room for");
    const bool first = r == begin;
    return read_row(row, r++, first);
  }));
  return r - begin;
}

core::Status Reader::read_row(sqlite3_stmt* row, Eigen::Index r, bool first) {
  const std::int64_t t_ns = sqlite3_column_int64(row, 0);
  const auto at = static_cast<std::size_t>(r);
  const bool backwards = !first && t_ns < recording_.t_ns[at - 1];
  if (sqlite3_column_type(row, 0) != SQLITE_INTEGER || backwards) {
    return damaged(fmt::format(
        "sample {}: t_ns is {}", r + 1,
        backwards ? fmt::format("{}, earlier than the sample before", t_ns) : "no integer"));
  }
  recording_.t_ns[at] = t_ns;
  for (Eigen::Index c = 0; c < recording_.samples.cols(); ++c) {
    const int column = static_cast<int>(c) + 1;
    const int type = sqlite3_column_type(row, column);
    double value = std::numeric_limits<double>::quiet_NaN();
    if (type == SQLITE_FLOAT || type == SQLITE_INTEGER) {
      value = sqlite3_column_double(row, column) * to_si_[static_cast<std::size_t>(c)];
    } else if (type != SQLITE_NULL) {
      return damaged(fmt::format("sample {}: channel {}: '{}' is not a number", r + 1,
                                 recording_.channels[static_cast<std::size_t>(c)].name,
                                 sqlite::text_of(row, column)));
    }
    recording_.samples(r, c) = value;
  }
  return {};
}

/// Rows are lost: an error, or an event where the user goes on without them.
core::Status Reader::give_up_rows(const std::string& why, bool skip_bad) {
  if (!skip_bad) {
    return damaged(
        fmt::format("{}; --skip-bad goes on without them, and `ravencal import {} "
                    "--skip-bad --out NEW.db` keeps the rest",
                    why, path_.string()));
  }
  recording_.events.push_back({recording_.rows() > 0 ? recording_.t_ns.back() : 0, "drop", why});
  return {};
}

// The rows of a writer that was killed are in its log, which may not have come along.
core::Status Reader::check_end(bool skip_bad) {
  if (is_finished_ || written_now_) return {};
  // A writer makes its log a moment after its recording.
  constexpr std::chrono::milliseconds kMoment{50};
  const fs::path log = path_.string() + "-wal";
  std::error_code absent;
  if (!fs::exists(log, absent)) std::this_thread::sleep_for(kMoment);
  if (fs::exists(log, absent)) return {};
  return give_up_rows(
      fmt::format("the recording was not finished, and its log {} is missing: {} rows can be read, "
                  "and those after them are lost unless the log is put back beside it",
                  log.filename().string(), recording_.rows()),
      skip_bad);
}

// What SQLite left out behind a damaged frame of the log.
core::Status Reader::check_log(bool skip_bad) {
  if (!written_now_) return {};
  RAVENCAL_ASSIGN_OR_RETURN(const auto damage, find_log_damage(path_, columns_));
  if (!damage) return {};
  const std::int64_t rows = recording_.rows();
  const std::string lost = damage->last_row > rows ? std::to_string(damage->last_row - rows) : "0";
  const std::string why = fmt::format(
      "{} of its log is damaged: {} rows behind the first {} are lost",
      damage->frame == 0 ? std::string("the beginning") : fmt::format("frame {}", damage->frame),
      lost, rows);
  RAVENCAL_RETURN_IF_ERROR(give_up_rows(why, skip_bad));
  recording_.meta["dropped_rows"] = lost;
  return {};
}

core::Result<Recording> Reader::read(unsigned threads, bool skip_bad) {
  RAVENCAL_RETURN_IF_ERROR(open());
  RAVENCAL_RETURN_IF_ERROR(read_meta());
  RAVENCAL_RETURN_IF_ERROR(read_channels());
  RAVENCAL_RETURN_IF_ERROR(read_events());
  RAVENCAL_RETURN_IF_ERROR(read_samples(threads));
  RAVENCAL_RETURN_IF_ERROR(check_end(skip_bad));
  RAVENCAL_RETURN_IF_ERROR(check_log(skip_bad));
  recording_.source = path_.string();
  return std::move(recording_);
}

core::Result<std::vector<Event>> Reader::read_events_only() {
  RAVENCAL_RETURN_IF_ERROR(open());
  RAVENCAL_RETURN_IF_ERROR(read_meta());
  RAVENCAL_RETURN_IF_ERROR(read_events());
  return std::move(recording_.events);
}

}  // namespace

core::Result<std::vector<Event>> read_events(const fs::path& path) {
  return Reader(path).read_events_only();
}

core::Result<Recording> read_recording(const fs::path& path, const ChannelFilter& keep,
                                       unsigned threads, bool skip_bad) {
  return Reader(path, keep)
      .read(threads != 0 ? threads : std::max(1U, std::thread::hardware_concurrency()), skip_bad);
}

}  // namespace ravencal::record
