// SPDX-License-Identifier: Apache-2.0
//
// Recordings that somebody made to harm their reader: refused in words, with little work and
// memory.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "record/recording_reader.hpp"
#include "scratch.hpp"

namespace ravencal::record {
namespace {

using testing::Scratch;

constexpr const char* kMeta =
    "CREATE TABLE meta(key TEXT, value TEXT); INSERT INTO meta VALUES('format_version','1');";
constexpr const char* kChannel =
    "CREATE TABLE channel(name TEXT, unit TEXT, role TEXT, joint TEXT);"
    "INSERT INTO channel VALUES('x','1','feature','');";
constexpr const char* kEvent = "CREATE TABLE event(t_ns INTEGER, kind TEXT, detail TEXT);";
constexpr const char* kSample =
    "CREATE TABLE sample(t_ns INTEGER, x REAL); INSERT INTO sample VALUES(1,1),(2,2);";

class HostileRecording : public ::testing::Test {
 protected:
  void make(const std::string& sql) const {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(path_.c_str(), &database), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(database, ("PRAGMA synchronous=OFF; BEGIN;" + sql + "COMMIT;").c_str(),
                           nullptr, nullptr, nullptr),
              SQLITE_OK)
        << sqlite3_errmsg(database);
    sqlite3_close(database);
  }
  void expect_refusal(const std::string& says) const {
    const auto read = read_recording(path_, {}, 2);
    ASSERT_FALSE(read.ok());
    EXPECT_EQ(read.error().code, core::ErrorCode::kData);
    EXPECT_TRUE(read.error().message.starts_with(path_.string())) << read.error().message;
    EXPECT_NE(read.error().message.find(says), std::string::npos) << read.error().message;
  }

  const Scratch scratch_;
  const std::filesystem::path path_ = scratch_ / "r.db";
};

TEST_F(HostileRecording, ReadsTheseTablesWhereNothingIsWrongWithThem) {
  make(std::string(kMeta) + kChannel + kEvent + kSample);
  const auto read = read_recording(path_);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->rows(), 2);
}

TEST_F(HostileRecording, ReadsNoViewInPlaceOfATable) {
  const std::string all[] = {kMeta, kChannel, kEvent, kSample};
  for (const std::string view : {"meta", "channel", "event", "sample"}) {
    std::filesystem::remove(path_);
    std::string sql;
    for (const std::string& table : all)
      if (table.find("TABLE " + view + "(") == std::string::npos) sql += table;
    make(sql + "CREATE VIEW " + view +
         " AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i+1 FROM n) SELECT i AS t_ns, "
         "1 AS x, 'a' AS name, 'b' AS key FROM n;");
    expect_refusal(view + " is a view");
  }
}

TEST_F(HostileRecording, ReadsNoVirtualTable) {
  make(std::string(kMeta) + kChannel + kEvent +
       "CREATE VIRTUAL TABLE sample USING rtree(t_ns, x, y);");
  expect_refusal("sample is a virtual table");
}

TEST_F(HostileRecording, ReadsNothingThatIsComputed) {
  const std::string tables = std::string(kMeta) + kChannel + kEvent;
  make(tables +
       "CREATE TABLE sample(t_ns INTEGER, x REAL AS (length(hex(zeroblob(1 << 24)))));"
       "INSERT INTO sample(t_ns) VALUES(1),(2);");
  expect_refusal("x of sample is a computed column");
  std::filesystem::remove(path_);
  make(tables + kSample + "CREATE TRIGGER t AFTER INSERT ON meta BEGIN SELECT 1; END;");
  expect_refusal("t is a trigger");
  std::filesystem::remove(path_);
  make(tables + kSample + "CREATE VIEW of_all AS SELECT * FROM sample;");
  expect_refusal("of_all is a view");
  std::filesystem::remove(path_);
  make(tables + kSample + "CREATE TABLE notes(text); CREATE INDEX by_time ON sample(t_ns);");
  EXPECT_TRUE(read_recording(path_).ok()) << "what a user added to look into it";
}

TEST_F(HostileRecording, EndsWhereTheTreeOfATableLeadsBackIntoItself) {
  make(std::string(kMeta) + kChannel + kEvent +
       "CREATE TABLE sample(t_ns INTEGER, x REAL);"
       "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i+1 FROM n WHERE i < 300000)"
       "INSERT INTO sample SELECT i, 1 FROM n;");
  // All pages below the root become one: a billion rows in a small file.
  std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
  std::vector<char> bytes((std::istreambuf_iterator<char>(file)), {});
  constexpr std::size_t kPage = 4096;
  constexpr char kInterior = 5;
  const auto number_at = [&](std::size_t at, std::size_t size) {
    std::size_t value = 0;
    for (std::size_t i = 0; i < size; ++i)
      value = value << 8U | static_cast<unsigned char>(bytes[at + i]);
    return value;
  };
  std::size_t linked = 0;
  for (std::size_t page = kPage; page + kPage <= bytes.size(); page += kPage) {
    if (bytes[page] != kInterior) continue;
    const std::size_t cells = number_at(page + 3, 2);
    if (cells < 2) continue;
    const std::size_t first = page + number_at(page + 12, 2);
    for (std::size_t c = 1; c < cells; ++c) {
      const std::size_t cell = page + number_at(page + 12 + 2 * c, 2);
      std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(first), 4,
                  bytes.begin() + static_cast<std::ptrdiff_t>(cell));
      ++linked;
    }
  }
  ASSERT_GT(linked, 300U);
  file.clear();
  file.seekp(0);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  EXPECT_FALSE(read_recording(path_, {}, 1).ok());
}

TEST_F(HostileRecording, AsksForNoMoreMemoryThanItsFileHasRoomFor) {
  // Rows of four bytes, and columns that were added without a value: 6 GB of samples.
  std::string sql = std::string(kMeta) + kChannel + kEvent +
                    "CREATE TABLE sample(t_ns INTEGER, x REAL);"
                    "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i+1 FROM n WHERE i < 400000)"
                    "INSERT INTO sample(t_ns) SELECT 1 FROM n;";
  for (int c = 1; c < 1998; ++c) {
    sql += fmt::format(
        "ALTER TABLE sample ADD COLUMN c{0} REAL;"
        "INSERT INTO channel VALUES('c{0}','1','feature','');",
        c);
  }
  make(sql);
  expect_refusal("400000 samples of 1998 channels are more than its");
}

TEST_F(HostileRecording, RefusesChannelsThatARecordingCannotHave) {
  for (const auto& [rows, says] :
       {std::pair{"('rowid','1','feature','')", "cannot be named 'rowid'"},
        std::pair{"('X','1','feature','')", "cannot be named 'X'"}}) {
    std::filesystem::remove(path_);
    make(std::string(kMeta) + kChannel + kEvent + kSample + "INSERT INTO channel VALUES" + rows +
         ";");
    expect_refusal(says);
  }
  std::filesystem::remove(path_);
  make(std::string(kMeta) + kChannel + kEvent + kSample +
       "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i+1 FROM n WHERE i < 3000)"
       "INSERT INTO channel SELECT 'c' || i, '1', 'feature', '' FROM n;");
  expect_refusal("3001 channels; a recording holds at most 1999");
}

}  // namespace
}  // namespace ravencal::record
