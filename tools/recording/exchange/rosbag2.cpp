// SPDX-License-Identifier: Apache-2.0
#include "exchange/rosbag2.hpp"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <atomic>

#include "exchange/joint_states.hpp"
#include "exchange/named_array.hpp"
#include "record/sqlite.hpp"

namespace ravencal::exchange {
namespace {

namespace sqlite = record::sqlite;

constexpr std::array<std::uint8_t, 4> kZstdFrame = {0x28, 0xB5, 0x2F, 0xFD};  // RFC 8878, 3.1.1

class Rosbag2Reader {
 public:
  Rosbag2Reader(const std::filesystem::path& path, bool skip_bad)
      : path_(path), topics_(path, skip_bad) {}

  core::Result<record::Table> read() {
    RAVENCAL_RETURN_IF_ERROR(open());
    RAVENCAL_RETURN_IF_ERROR(
        for_each("SELECT id, name, type, serialization_format FROM topics",
                 [&](sqlite3_stmt* row) -> core::Status {
                   topics_.add_topic(static_cast<std::uint64_t>(sqlite3_column_int64(row, 0)),
                                     sqlite::text_of(row, 1), sqlite::text_of(row, 2),
                                     sqlite::text_of(row, 3));
                   return {};
                 }));
    RAVENCAL_RETURN_IF_ERROR(
        for_each("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp, id",
                 [&](sqlite3_stmt* row) { return take(row); }));
    return std::move(topics_).table();
  }

 private:
  core::Status open() {
    RAVENCAL_RETURN_IF_ERROR(check_is_there(path_));
    operations_left_ = sqlite::operations_for(std::filesystem::file_size(path_));
    sqlite3* handle = nullptr;
    const int code = sqlite3_open_v2(path_.c_str(), &handle, SQLITE_OPEN_READONLY, nullptr);
    database_.reset(handle);
    if (code != SQLITE_OK) return sqlite::last_error(handle, path_, "cannot open");
    sqlite::distrust(handle, operations_left_);
    RAVENCAL_RETURN_IF_ERROR(sqlite::check_schema(handle, path_));
    bool has_messages = false;
    RAVENCAL_RETURN_IF_ERROR(for_each("SELECT 1 FROM sqlite_schema WHERE name = 'messages'",
                                      [&](sqlite3_stmt*) -> core::Status {
                                        has_messages = true;
                                        return {};
                                      }));
    if (has_messages) return {};
    return core::data_error(
        fmt::format("{}: has no table 'messages', so it is no bag of rosbag2; a recording of "
                    "ravencal is called .db",
                    path_.string()));
  }

  template <typename OnRow>
  core::Status for_each(const std::string& sql, OnRow&& on_row) {
    RAVENCAL_ASSIGN_OR_RETURN(const sqlite::Statement rows,
                              sqlite::prepare(database_.get(), path_, sql));
    int code = SQLITE_ROW;
    while ((code = sqlite3_step(rows.get())) == SQLITE_ROW)
      RAVENCAL_RETURN_IF_ERROR(on_row(rows.get()));
    if (code == SQLITE_DONE) return {};
    return sqlite::last_error(database_.get(), path_, "cannot read");
  }

  core::Status take(sqlite3_stmt* row) {
    const auto id = static_cast<std::uint64_t>(sqlite3_column_int64(row, 0));
    if (!topics_.is_wanted(id)) return {};
    const std::int64_t log_time_ns = sqlite3_column_int64(row, 1);
    const auto* const data = static_cast<const std::uint8_t*>(sqlite3_column_blob(row, 2));
    const std::span bytes(data, static_cast<std::size_t>(sqlite3_column_bytes(row, 2)));
    if (bytes.size() >= kZstdFrame.size() &&
        std::equal(kZstdFrame.begin(), kZstdFrame.end(), bytes.begin())) {
      return core::data_error(
          fmt::format("{}: its messages are compressed; `ros2 bag convert` with the output option "
                      "compression_mode: none makes a bag that can be read",
                      path_.string()));
    }
    return topics_.add_message(id, log_time_ns, bytes);
  }

  const std::filesystem::path& path_;
  std::atomic<std::int64_t> operations_left_{0};
  sqlite::Database database_;
  JointStateTopics topics_;
};

}  // namespace

core::Result<record::Table> read_rosbag2(const std::filesystem::path& path,
                                         const record::LoadOptions& options) {
  return Rosbag2Reader(path, options.skip_bad).read();
}

}  // namespace ravencal::exchange
