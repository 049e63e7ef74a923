// SPDX-License-Identifier: Apache-2.0
#include "record/time_range.hpp"

#include <gtest/gtest.h>

#include "record/load.hpp"
#include "record/recording_writer.hpp"
#include "scratch.hpp"

namespace ravencal::record {
namespace {

using testing::Scratch;

/// Rows at 100.0, 100.5, 101.0, ... s, with their number as value.
Recording half_seconds(int rows) {
  Recording recording;
  recording.source = "r.db";
  recording.channels = {{"q", "rad", Role::kFeature, ""}};
  recording.samples.resize(rows, 1);
  for (int row = 0; row < rows; ++row) {
    recording.t_ns.push_back(100'000'000'000 + row * std::int64_t{500'000'000});
    recording.samples(row, 0) = row;
  }
  recording.events = {{99'000'000'000, "homing", "before"},
                      {100'900'000'000, "homing", "inside"},
                      {102'000'000'000, "homing", "at the end"}};
  return recording;
}

TEST(TimeRange, KeepsRowsAndEventsFromTheFirstTimeUpToTheSecond) {
  Recording recording = half_seconds(10);
  ASSERT_TRUE(cut_to(recording, {0.5, 2.0}).ok());
  ASSERT_EQ(recording.rows(), 3);
  EXPECT_EQ(recording.t_ns.front(), 100'500'000'000);
  EXPECT_EQ(recording.samples(0, 0), 1.0);
  EXPECT_EQ(recording.samples(2, 0), 3.0);
  ASSERT_EQ(recording.events.size(), 1U);
  EXPECT_EQ(recording.events[0].detail, "inside");
  EXPECT_EQ(recording.meta.at("from_s"), "0.5");
  EXPECT_EQ(recording.meta.at("to_s"), "2");
}

TEST(TimeRange, PartsOfARecordingShareNoRow) {
  Recording first = half_seconds(10);
  Recording rest = half_seconds(10);
  ASSERT_TRUE(cut_to(first, {{}, 2.0}).ok());
  ASSERT_TRUE(cut_to(rest, {2.0, {}}).ok());
  EXPECT_EQ(first.rows() + rest.rows(), 10);
  EXPECT_LT(first.t_ns.back(), rest.t_ns.front());
  EXPECT_FALSE(first.meta.contains("from_s"));
}

TEST(TimeRange, OfAPartCountsFromTheWholeInTheMetadata) {
  Recording recording = half_seconds(10);
  ASSERT_TRUE(cut_to(recording, {1.0, {}}).ok());
  ASSERT_TRUE(cut_to(recording, {0.5, 1.5}).ok());
  EXPECT_EQ(recording.samples(0, 0), 3.0);
  EXPECT_EQ(recording.meta.at("from_s"), "1.5");
  EXPECT_EQ(recording.meta.at("to_s"), "2.5");
}

TEST(TimeRange, ThatHoldsNoRowSaysHowLongTheRecordingIs) {
  Recording recording = half_seconds(10);
  EXPECT_EQ(cut_to(recording, {2.0, 2.0}).error().message,
            "r.db: --from-s 2 is not before --to-s 2");
  EXPECT_EQ(cut_to(recording, {50.0, 60.0}).error().message,
            "r.db: no row from 50 s to 60 s; the recording is 4.5 s long");
  EXPECT_EQ(cut_to(recording, {50.0, {}}).error().code, core::ErrorCode::kUsage);
  EXPECT_EQ(recording.rows(), 10);
}

TEST(TimeRange, IsAskedForWhereverARecordingIsRead) {
  const Scratch scratch;
  LoadOptions options;
  options.profile = "generic";
  options.range = {1.0, 3.0};
  const auto csv =
      load_recording(scratch.write("a.csv", "t_s,q_rad\n5,0\n6,1\n7,2\n8,3\n"), options);
  ASSERT_TRUE(csv.ok()) << csv.error().message;
  EXPECT_EQ(csv->rows(), 2);
  ASSERT_TRUE(write_recording(half_seconds(10), scratch / "r.db").ok());
  const auto db = load_recording(scratch / "r.db", options);
  ASSERT_TRUE(db.ok()) << db.error().message;
  EXPECT_EQ(db->rows(), 4);
  EXPECT_EQ(db->meta.at("to_s"), "3");
}

}  // namespace
}  // namespace ravencal::record
