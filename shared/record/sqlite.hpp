// SPDX-License-Identifier: Apache-2.0
//
// SQLite handles that close themselves and errors that name the file. Private to record/.
#pragma once

#include <sqlite3.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace ravencal::record::sqlite {

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close_v2(database); }
};
struct FinalizeStatement {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Database = std::unique_ptr<sqlite3, CloseDatabase>;
using Statement = std::unique_ptr<sqlite3_stmt, FinalizeStatement>;

/// What SQLite says about its last failure, with file name and remedy.
core::Error last_error(sqlite3* database, const std::filesystem::path& path,
                       std::string_view doing);

core::Status execute(sqlite3* database, const std::filesystem::path& path, const std::string& sql);

core::Result<Statement> prepare(sqlite3* database, const std::filesystem::path& path,
                                const std::string& sql);

/// How many operations a reader of a file of so many bytes can need, several times over.
std::int64_t operations_for(std::uintmax_t bytes);

/// Before a file of anybody is read: no views, triggers or functions of its own, texts of at most
/// 64 MiB, and an end (SQLITE_INTERRUPT) where no operation is left, as in tables that lead back
/// into themselves. `operations_left` outlives the connection; several may share it.
void distrust(sqlite3* database, std::atomic<std::int64_t>& operations_left);

/// Before the tables are read: kData for what no writer makes and what could run or have no end,
/// which are views, triggers, virtual tables and columns whose values are computed.
core::Status check_schema(sqlite3* database, const std::filesystem::path& path);

/// An identifier in double quotes, as SQL wants it.
std::string quoted(std::string_view name);

/// Text of a result column; empty if NULL.
std::string text_of(sqlite3_stmt* statement, int column);

void bind_text(sqlite3_stmt* statement, int index, std::string_view text);

}  // namespace ravencal::record::sqlite
