// SPDX-License-Identifier: Apache-2.0
#include "record/sqlite.hpp"

#include <fmt/format.h>

#include <cstring>

namespace ravencal::record::sqlite {
namespace {

std::string_view remedy_for(int code) {
  switch (code & 0xff) {
    case SQLITE_FULL:
      return "; free space on that disk and try again";
    case SQLITE_CANTOPEN:
    case SQLITE_PERM:
    case SQLITE_READONLY:
      return "; check that the folder exists and may be written";
    case SQLITE_NOTADB:
    case SQLITE_CORRUPT:
      return "; this is no intact recording";
    case SQLITE_INTERRUPT:
      return ": a file of its size holds less; this is no intact recording";
    case SQLITE_BUSY:
      return "; another program is writing this file";
    default:
      return "";
  }
}

}  // namespace

core::Error last_error(sqlite3* database, const std::filesystem::path& path,
                       std::string_view doing) {
  const int code = sqlite3_errcode(database);
  const int primary = code & 0xff;
  const bool content = primary == SQLITE_NOTADB || primary == SQLITE_CORRUPT ||
                       primary == SQLITE_ERROR || primary == SQLITE_INTERRUPT ||
                       primary == SQLITE_TOOBIG;
  const int system_error = primary == SQLITE_IOERR ? sqlite3_system_errno(database) : 0;
  const std::string cause =
      system_error == 0 ? "" : fmt::format(" ({})", std::strerror(system_error));
  return {content ? core::ErrorCode::kData : core::ErrorCode::kIo,
          fmt::format("{}: {}: {}{}{}", path.string(), doing, sqlite3_errmsg(database), cause,
                      remedy_for(code))};
}

core::Status execute(sqlite3* database, const std::filesystem::path& path, const std::string& sql) {
  if (sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK) return {};
  return last_error(database, path, "cannot write");
}

core::Result<Statement> prepare(sqlite3* database, const std::filesystem::path& path,
                                const std::string& sql) {
  sqlite3_stmt* statement = nullptr;
  const int code =
      sqlite3_prepare_v2(database, sql.c_str(), static_cast<int>(sql.size()), &statement, nullptr);
  if (code != SQLITE_OK) return last_error(database, path, "not a recording");
  return Statement(statement);
}

std::int64_t operations_for(std::uintmax_t bytes) {
  // A row has a byte and takes about one operation for each of its columns.
  constexpr std::uintmax_t kOperationsPerByte = 16;
  constexpr std::uintmax_t kLeastOperations = 10'000'000;
  return static_cast<std::int64_t>(kLeastOperations + kOperationsPerByte * bytes);
}

void distrust(sqlite3* database, std::atomic<std::int64_t>& operations_left) {
  constexpr int kOperationsPerLook = 10'000;
  constexpr int kLongestValue = 64 << 20;
  for (const int what : {SQLITE_DBCONFIG_ENABLE_VIEW, SQLITE_DBCONFIG_ENABLE_TRIGGER,
                         SQLITE_DBCONFIG_TRUSTED_SCHEMA}) {
    (void)sqlite3_db_config(database, what, 0, nullptr);
  }
  (void)sqlite3_limit(database, SQLITE_LIMIT_LENGTH, kLongestValue);
  (void)sqlite3_limit(database, SQLITE_LIMIT_ATTACHED, 0);
  const auto look = [](void* left) {
    return (*static_cast<std::atomic<std::int64_t>*>(left) -= kOperationsPerLook) < 0 ? 1 : 0;
  };
  sqlite3_progress_handler(database, kOperationsPerLook, look, &operations_left);
}

core::Status check_schema(sqlite3* database, const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(
      const Statement found,
      prepare(
          database, path,
          "SELECT name || ' is a ' || CASE type WHEN 'table' THEN 'virtual table' ELSE type END "
          "FROM sqlite_schema WHERE type IN ('view', 'trigger') "
          "OR (type = 'table' AND rootpage = 0) "
          "UNION ALL SELECT c.name || ' of ' || t.name || ' is a computed column' "
          "FROM sqlite_schema t, pragma_table_xinfo(t.name) c "
          "WHERE t.type = 'table' AND t.rootpage != 0 AND c.hidden != 0"));
  switch (sqlite3_step(found.get())) {
    case SQLITE_DONE:
      return {};
    case SQLITE_ROW:
      return core::data_error(fmt::format("{}: {}; only tables that hold their values are read",
                                          path.string(), text_of(found.get(), 0)));
    default:
      return last_error(database, path, "cannot read");
  }
}

std::string quoted(std::string_view name) {
  std::string text = "\"";
  for (const char c : name) {
    if (c == '"') text += '"';
    text += c;
  }
  return text + '"';
}

std::string text_of(sqlite3_stmt* statement, int column) {
  const unsigned char* text = sqlite3_column_text(statement, column);
  return text == nullptr ? std::string() : reinterpret_cast<const char*>(text);
}

void bind_text(sqlite3_stmt* statement, int index, std::string_view text) {
  sqlite3_bind_text(statement, index, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT);
}

}  // namespace ravencal::record::sqlite
