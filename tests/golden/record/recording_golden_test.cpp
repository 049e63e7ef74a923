// SPDX-License-Identifier: Apache-2.0
//
// A recording of format 1, kept as bytes, and its twin in words: readers of all later versions must
// read it, and the writer of this version must still write the same tables.
// RAVENCAL_WRITE_GOLDEN=1 record_golden_test writes v1.db anew.
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "../../unit/record/scratch.hpp"
#include "core/units.hpp"
#include "record/recording_reader.hpp"
#include "record/recording_writer.hpp"

namespace ravencal::record {
namespace {

const std::string kFolder = RAVENCAL_SOURCE_DIR "/tests/golden/record/";

nlohmann::json twin() { return nlohmann::json::parse(std::ifstream(kFolder + "v1.json")); }

void write_twin(const std::filesystem::path& path) {
  const nlohmann::json json = twin();
  std::vector<Channel> channels;
  for (const auto& c : json["channels"]) {
    channels.push_back(
        {c["name"], c["unit"], *role_from(c["role"].get<std::string>()), c["joint"]});
  }
  auto writer = RecordingWriter::create(path, json["meta"], channels, true);
  ASSERT_TRUE(writer.ok()) << writer.error().message;
  for (const auto& sample : json["samples"]) {
    std::vector<double> values;
    for (std::size_t i = 1; i < sample.size(); ++i) {
      values.push_back(sample[i].is_null() ? std::numeric_limits<double>::quiet_NaN()
                                           : sample[i].get<double>());
    }
    ASSERT_TRUE(writer->append(sample[0], values).ok());
  }
  for (const auto& event : json["events"]) {
    ASSERT_TRUE(writer->append_event({event[0], event[1], event[2]}).ok());
  }
  ASSERT_TRUE(writer->finish().ok());
}

std::string rows_of(const std::filesystem::path& path, const std::string& sql) {
  std::string text;
  sqlite3* database = nullptr;
  sqlite3_open_v2(("file:" + path.string() + "?immutable=1").c_str(), &database,
                  SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
  const auto append = [](void* out, int count, char** values, char**) {
    for (int i = 0; i < count; ++i) {
      *static_cast<std::string*>(out) +=
          (values[i] == nullptr ? "NULL" : values[i]) + std::string("|");
    }
    *static_cast<std::string*>(out) += "\n";
    return 0;
  };
  sqlite3_exec(database, sql.c_str(), append, &text, nullptr);
  sqlite3_close(database);
  return text;
}

TEST(GoldenRecording, IsReadAsItsTwinSays) {
  if (std::getenv("RAVENCAL_WRITE_GOLDEN") != nullptr) write_twin(kFolder + "v1.db");
  const auto read = read_recording(kFolder + "v1.db");
  ASSERT_TRUE(read.ok()) << read.error().message;
  const nlohmann::json json = twin();
  for (const auto& [key, value] : json["meta"].items()) EXPECT_EQ(read->meta.at(key), value);
  ASSERT_EQ(read->channels.size(), json["channels"].size());
  ASSERT_EQ(read->t_ns.size(), json["samples"].size());
  for (std::size_t c = 0; c < read->channels.size(); ++c) {
    const auto& channel = json["channels"][c];
    const auto unit = core::find_unit(channel["unit"].get<std::string>());
    EXPECT_EQ(read->channels[c].name, channel["name"]);
    EXPECT_EQ(read->channels[c].unit, unit->si_name);
    EXPECT_EQ(name_of(read->channels[c].role), channel["role"]);
    EXPECT_EQ(read->channels[c].joint, channel["joint"]);
    for (std::size_t r = 0; r < read->t_ns.size(); ++r) {
      const auto& value = json["samples"][r][c + 1];
      const double found =
          read->samples(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
      EXPECT_TRUE(value.is_null() ? std::isnan(found) : found == value.get<double>() * unit->to_si);
      EXPECT_EQ(read->t_ns[r], json["samples"][r][0]);
    }
  }
  ASSERT_EQ(read->events.size(), json["events"].size());
  for (std::size_t e = 0; e < read->events.size(); ++e) {
    EXPECT_EQ(nlohmann::json({read->events[e].t_ns, read->events[e].kind, read->events[e].detail}),
              json["events"][e]);
  }
}

TEST(GoldenRecording, IsWhatThisVersionStillWrites) {
  const testing::Scratch scratch;
  write_twin(scratch / "new.db");
  for (const char* sql :
       {"SELECT type, name, sql FROM sqlite_schema", "SELECT * FROM channel",
        "SELECT * FROM sample", "SELECT * FROM event",
        "SELECT * FROM meta WHERE key NOT IN ('software_version', 'finished') ORDER BY key",
        "PRAGMA application_id", "PRAGMA journal_mode"}) {
    EXPECT_EQ(rows_of(scratch / "new.db", sql), rows_of(kFolder + "v1.db", sql)) << sql;
    EXPECT_FALSE(rows_of(kFolder + "v1.db", sql).empty()) << sql;
  }
}

}  // namespace
}  // namespace ravencal::record
