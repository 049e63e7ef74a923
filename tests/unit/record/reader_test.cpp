// SPDX-License-Identifier: Apache-2.0
//
// Several threads read a long recording; the result must be that of one thread.
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cmath>

#include "record/load.hpp"
#include "record/recording_reader.hpp"
#include "record/recording_writer.hpp"
#include "scratch.hpp"

namespace ravencal::record {
namespace {

using testing::Scratch;

constexpr Eigen::Index kRows = 40000;

/// Every sample tells its number.
void write_numbered(const std::filesystem::path& path) {
  Recording recording;
  recording.channels = {{"q.elbow", "rad", Role::kJointEstimate, "elbow"},
                        {"truth.elbow", "rad", Role::kJointTruth, "elbow"}};
  recording.samples.resize(kRows, 2);
  for (Eigen::Index r = 0; r < kRows; ++r) {
    recording.t_ns.push_back(1000 * (r + 1));
    recording.samples.row(r) << static_cast<double>(r + 1), -static_cast<double>(r + 1);
  }
  ASSERT_TRUE(write_recording(recording, path, true).ok());
}

void change(const std::filesystem::path& path, const std::string& sql) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(database);
}

class RecordingReader : public ::testing::TestWithParam<unsigned> {
 protected:
  void SetUp() override { write_numbered(path_); }
  [[nodiscard]] core::Result<Recording> read() const {
    return read_recording(path_, {}, GetParam());
  }

  const Scratch scratch_;
  const std::filesystem::path path_ = scratch_ / "long.db";
};

TEST_P(RecordingReader, ReadsEverySampleInItsPlace) {
  const auto read = this->read();
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->rows(), kRows);
  ASSERT_EQ(read->t_ns.size(), static_cast<std::size_t>(kRows));
  for (Eigen::Index r = 0; r < kRows; ++r) {
    ASSERT_EQ(read->t_ns[static_cast<std::size_t>(r)], 1000 * (r + 1));
    ASSERT_EQ(read->samples(r, 0), static_cast<double>(r + 1));
    ASSERT_EQ(read->samples(r, 1), -static_cast<double>(r + 1));
  }
}

TEST_P(RecordingReader, ClosesGapsInTheNumbersOfSamples) {
  change(path_, "DELETE FROM sample WHERE rowid BETWEEN 12001 AND 12500 OR rowid = 30000");
  const auto read = this->read();
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->rows(), kRows - 501);
  EXPECT_EQ(read->samples(11999, 0), 12000.0);
  EXPECT_EQ(read->samples(12000, 0), 12501.0);
  EXPECT_EQ(read->t_ns.back(), 1000 * kRows);
  EXPECT_EQ(read->samples(read->rows() - 1, 1), -static_cast<double>(kRows));
}

TEST_P(RecordingReader, NamesTheFirstDamageAndItsSample) {
  change(path_, "UPDATE sample SET \"truth.elbow\" = 'far' WHERE rowid IN (17001, 38000)");
  const auto read = this->read();
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().message,
            path_.string() + ": sample 17001: channel truth.elbow: 'far' is not a number");
}

TEST_P(RecordingReader, SeesTimeRunBackwardsWhereverItDoes) {
  for (const int sample : {2, 10001, 20001, 30001, 39999}) {
    write_numbered(path_);
    change(path_, "UPDATE sample SET t_ns = 7 WHERE rowid = " + std::to_string(sample));
    const auto read = this->read();
    ASSERT_FALSE(read.ok()) << sample;
    EXPECT_EQ(read.error().message, path_.string() + ": sample " + std::to_string(sample) +
                                        ": t_ns is 7, earlier than the sample before");
  }
}

INSTANTIATE_TEST_SUITE_P(Threads, RecordingReader, ::testing::Values(1U, 2U, 4U));

TEST(LoadRecording, TakesNoValueThatNoSensorMeasures) {
  const Scratch scratch;
  const std::filesystem::path path = scratch / "odd.db";
  write_numbered(path);
  change(path, "UPDATE sample SET \"truth.elbow\" = 1e300 WHERE t_ns = 7000");
  change(path, "UPDATE sample SET \"truth.elbow\" = -9e999 WHERE t_ns = 9000");
  const auto refused = load_recording(path, {});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, core::ErrorCode::kData);
  EXPECT_EQ(refused.error().message,
            path.string() +
                ": row 7: truth.elbow is 1e+300, which no sensor measures; use --skip-bad to read "
                "it as missing");
  LoadOptions skipping;
  skipping.skip_bad = true;
  const auto read = load_recording(path, skipping);
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->events.size(), 2U);
  EXPECT_EQ(read->events[1].kind, "drop");
  EXPECT_EQ(read->events[1].t_ns, 9000);
  for (Eigen::Index r = 0; r < kRows; ++r)
    ASSERT_EQ(std::isnan(read->samples(r, 1)), r == 6 || r == 8) << r;
}

}  // namespace
}  // namespace ravencal::record
