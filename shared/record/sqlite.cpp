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
  const bool content =
      primary == SQLITE_NOTADB || primary == SQLITE_CORRUPT || primary == SQLITE_ERROR;
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
