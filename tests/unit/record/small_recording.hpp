// SPDX-License-Identifier: Apache-2.0
//
// Channels of a small recording, and a look into it past the reader.
#pragma once

#include <sqlite3.h>

#include <filesystem>
#include <string>
#include <vector>

#include "record/channel.hpp"

namespace ravencal::record::testing {

inline std::vector<Channel> two_channels() {
  return {{"jpos.elbow", "deg", Role::kJointEstimate, "elbow"},
          {"truth.elbow", "rad", Role::kJointTruth, "elbow"}};
}

/// The first column of the first row of a query, as the sqlite3 shell would show it.
inline std::string ask(const std::filesystem::path& path, const std::string& sql) {
  sqlite3* database = nullptr;
  sqlite3_open(path.c_str(), &database);
  sqlite3_busy_timeout(database, 600'000);
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(database, sql.c_str(), -1, &statement, nullptr);
  std::string answer = "nothing";
  if (sqlite3_step(statement) == SQLITE_ROW) {
    const unsigned char* text = sqlite3_column_text(statement, 0);
    answer = text == nullptr ? "NULL" : reinterpret_cast<const char*>(text);
  }
  sqlite3_finalize(statement);
  sqlite3_close(database);
  return answer;
}

}  // namespace ravencal::record::testing
