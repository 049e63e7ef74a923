// SPDX-License-Identifier: Apache-2.0
//
// The reader of the telemetry against segments made by hand: what it takes, what it refuses, what
// it knows to be lost.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>

#include "monitor/telemetry_follower.hpp"
#include "unit/telemetry_segment.hpp"

namespace ravencal::test {
namespace {

using monitor::Change;
using monitor::NumberedTick;
using monitor::TelemetryFollower;
using monitor::TelemetryReader;
using monitor::Writer;

TelemetryReader opened(const std::string& name) {
  core::Result<TelemetryReader> reader = TelemetryReader::open(name);
  if (!reader.ok()) {
    ADD_FAILURE() << reader.error().message;
    std::abort();
  }
  return std::move(reader).value();
}

std::vector<NumberedTick> read(TelemetryReader& reader) {
  std::vector<NumberedTick> ticks;
  reader.read(ticks);
  return ticks;
}

core::Error refusal(const std::string& name) {
  const core::Result<TelemetryReader> reader = TelemetryReader::open(name);
  EXPECT_FALSE(reader.ok()) << name;
  return reader.ok() ? core::Error{} : reader.error();
}

TEST(TelemetryReader, GivesEveryTickOnceInOrder) {
  const std::string name = telemetry_name("once");
  TelemetrySegment segment(name);
  TelemetryReader reader = opened(name);
  EXPECT_TRUE(read(reader).empty());
  std::uint64_t seen = 0;
  for (int round = 0; round < 20; ++round) {
    for (int i = 0; i < 50; ++i) segment.write();
    for (const NumberedTick& tick : read(reader)) {
      EXPECT_EQ(tick.number, seen++);
      EXPECT_TRUE(is_whole(tick.tick, tick.number));
    }
  }
  EXPECT_EQ(seen, 1000U);
  EXPECT_TRUE(read(reader).empty());
  EXPECT_EQ(reader.writer_pid(), 4711U);
  EXPECT_EQ(reader.plugin_version(), "9.8.7");
}

TEST(TelemetryReader, KnowsWhichTicksItWasTooSlowFor) {
  const std::string name = telemetry_name("slow");
  TelemetrySegment segment(name);
  TelemetryReader reader = opened(name);
  for (int i = 0; i < 1000; ++i) segment.write();
  const std::vector<NumberedTick> ticks = read(reader);
  ASSERT_EQ(ticks.size(), 64U - 64 / 8) << "the oldest eighth is about to be overwritten";
  EXPECT_EQ(ticks.front().number, 1000U - 64 + 64 / 8);
  EXPECT_EQ(ticks.back().number, 999U);
  for (const NumberedTick& tick : ticks) EXPECT_TRUE(is_whole(tick.tick, tick.number));
}

TEST(TelemetryReader, SkipsATickThatIsBeingOverwritten) {
  const std::string name = telemetry_name("overwritten");
  TelemetrySegment segment(name);
  TelemetryReader reader = opened(name);
  for (int i = 0; i < 3; ++i) segment.write();
  segment.slot(1).sequence = 2 * 65 + 1;  // the writer has come round and is at this slot
  const std::vector<NumberedTick> ticks = read(reader);
  ASSERT_EQ(ticks.size(), 2U);
  EXPECT_EQ(ticks[0].number, 0U);
  EXPECT_EQ(ticks[1].number, 2U);
}

TEST(TelemetryReader, SeesNoTornTickWhileAnotherThreadWrites) {
  const std::string name = telemetry_name("torn");
  TelemetrySegment segment(name, RAVENCAL_TELEMETRY_SLOTS);
  TelemetryReader reader = opened(name);
  std::atomic<bool> stop{false};
  std::thread writer([&] {
    while (!stop.load()) segment.write();
  });
  std::uint64_t seen = 0;
  std::uint64_t torn = 0;
  while (seen < 300'000) {
    for (const NumberedTick& tick : read(reader)) {
      ++seen;
      torn += is_whole(tick.tick, tick.number) ? 0 : 1;
    }
  }
  stop.store(true);
  writer.join();
  EXPECT_EQ(torn, 0U);
}

TEST(TelemetryReader, GivesNoCountersThatAWriterDiedWriting) {
  const std::string name = telemetry_name("counters");
  TelemetrySegment segment(name);
  const TelemetryReader reader = opened(name);
  segment.header().counters.swaps = 7;
  ASSERT_TRUE(reader.counters().has_value());
  EXPECT_EQ(reader.counters()->swaps, 7U);
  segment.header().counters_sequence = 5;
  EXPECT_FALSE(reader.counters().has_value());
}

TEST(TelemetryReader, TellsAWriterThatEndedFromOneThatIsGone) {
  const std::string name = telemetry_name("writer");
  TelemetrySegment ending(name);
  const TelemetryReader first = opened(name);
  EXPECT_EQ(first.writer(), Writer::kAlive);
  EXPECT_EQ(first.writer(), Writer::kAlive) << "asking must not change the answer";
  ending.close_in_order();
  EXPECT_EQ(first.writer(), Writer::kEnded);
  TelemetrySegment dying(name);
  const TelemetryReader second = opened(name);
  EXPECT_EQ(second.writer(), Writer::kAlive);
  dying.drop_lock();
  EXPECT_EQ(second.writer(), Writer::kGone);
}

TEST(TelemetryReader, NamesWhatIsWrong) {
  for (const char* name : {"", "/", "x", "ravencal", "/a/b", "/../etc/passwd", "/.hidden"}) {
    EXPECT_EQ(refusal(name).code, core::ErrorCode::kUsage) << name;
  }
  EXPECT_EQ(refusal("/ravencal_test_nobody").code, core::ErrorCode::kIo);
  EXPECT_NE(refusal("/ravencal_test_nobody").message.find("telemetry_name"), std::string::npos);

  const std::string name = telemetry_name("wrong");
  std::ofstream("/dev/shm" + name) << "short";
  EXPECT_EQ(refusal(name).code, core::ErrorCode::kData);
  const auto damaged = [&](auto damage) {
    TelemetrySegment segment(name);
    damage(segment.header().label);
    segment.write_label();
    return refusal(name);
  };
  using Label = ravencal_telemetry_label;
  EXPECT_NE(damaged([](Label& l) { l.magic[0] = 'X'; }).message.find("something else"),
            std::string::npos);
  EXPECT_NE(damaged([](Label& l) { l.version = 99; }).message.find("version 99"),
            std::string::npos);
  for (const auto& damage : std::initializer_list<void (*)(Label&)>{
           [](Label& l) { l.slot_count = 1U << 31; }, [](Label& l) { l.slot_count = 63; },
           [](Label& l) { l.slot_count = 0; }, [](Label& l) { l.slot_bytes = 8; },
           [](Label& l) { l.header_bytes = 8; }, [](Label& l) { l.header_bytes = 0xFFFFFFF8U; },
           [](Label& l) { l.tick_ns = 0; }}) {
    EXPECT_NE(damaged(damage).message.find("sizes"), std::string::npos);
  }
}

TEST(TelemetryReader, TakesNoMemoryButThatOfItsWriter) {
  const std::string name = telemetry_name("memory");
  TelemetrySegment segment(name);
  TelemetrySegment other(telemetry_name("other_memory"));
  other.header().label.writer_pid = 4712;
  const std::int32_t own = segment.header().label.memory_id;
  const auto named = [&](std::int32_t id) {
    ravencal_telemetry_label label = segment.header().label;
    label.memory_id = id;
    std::ofstream("/dev/shm" + name, std::ios::binary | std::ios::in)
        .write(reinterpret_cast<const char*>(&label), sizeof label);
  };
  named(other.header().label.memory_id);
  EXPECT_EQ(refusal(name).code, core::ErrorCode::kIo) << "another's, with another label";
  named(-1);
  EXPECT_EQ(refusal(name).code, core::ErrorCode::kIo);
  named(own);
  EXPECT_TRUE(TelemetryReader::open(name).ok());
}

bool is_listed(const std::string& name) {
  const std::vector<std::string> names = monitor::telemetry_names();
  return std::find(names.begin(), names.end(), name) != names.end();
}

TEST(TelemetryReader, TrustsNoOtherUserThanRootUnasked) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can make files of other users";
  constexpr uid_t kStranger = 54321;
  const std::string name = telemetry_name("stranger");
  TelemetrySegment segment(name);
  ASSERT_EQ(::chown(("/dev/shm" + name).c_str(), kStranger, 0), 0);
  EXPECT_NE(refusal(name).message.find("belongs to another user (54321)"), std::string::npos)
      << refusal(name).message;
  EXPECT_FALSE(is_listed(name));
  EXPECT_FALSE(TelemetryReader::open(name, 54322).ok());
  EXPECT_TRUE(TelemetryReader::open(name, kStranger).ok());
}

TEST(TelemetryReader, SaysOfADeadWriterThatItIsDead) {
  const std::string name = telemetry_name("dead_writer");
  {
    TelemetrySegment segment(name);
    EXPECT_TRUE(is_listed(name));
  }
  const core::Error error = refusal(name);
  EXPECT_EQ(error.code, core::ErrorCode::kIo);
  EXPECT_NE(error.message.find("process 4711, was killed or crashed"), std::string::npos)
      << error.message;
  EXPECT_FALSE(is_listed(name));
}

TEST(TelemetryReader, GoesOnWhereTheFileIsTruncated) {
  const std::string name = telemetry_name("cut");
  TelemetrySegment segment(name);
  TelemetryReader reader = opened(name);
  std::filesystem::resize_file("/dev/shm" + name, 0);
  segment.write();
  EXPECT_EQ(read(reader).size(), 1U);
}

TEST(TelemetryReader, FindsWhatIsThere) {
  const std::string name = telemetry_name("found");
  const std::string other = telemetry_name("no_telemetry");
  std::ofstream("/dev/shm" + other) << "something else that is long enough";
  const TelemetrySegment segment(name);
  EXPECT_TRUE(is_listed(name));
  EXPECT_FALSE(is_listed(other));
}

TEST(TelemetryFollower, GoesOnWithTheNextWriterAndLosesNothing) {
  const std::string name = telemetry_name("follow");
  auto first = std::make_unique<TelemetrySegment>(name);
  TelemetryFollower follower(opened(name));
  std::vector<NumberedTick> ticks;
  first->write();
  EXPECT_EQ(follower.poll(ticks), Change::kNone);
  first->write();
  first->close_in_order();
  EXPECT_EQ(follower.poll(ticks), Change::kEnded);
  EXPECT_EQ(ticks.size(), 2U) << "the last tick before the end";
  EXPECT_EQ(follower.poll(ticks), Change::kNone);
  EXPECT_EQ(follower.writer(), Writer::kEnded);

  auto second = std::make_unique<TelemetrySegment>(name);
  second->write();
  ticks.clear();
  EXPECT_EQ(follower.poll(ticks), Change::kAttached);
  EXPECT_EQ(follower.writer(), Writer::kAlive);
  EXPECT_EQ(follower.poll(ticks), Change::kNone);
  ASSERT_EQ(ticks.size(), 1U);
  EXPECT_EQ(ticks[0].number, 0U);

  second->drop_lock();
  EXPECT_EQ(follower.poll(ticks), Change::kGone);
  EXPECT_EQ(follower.poll(ticks), Change::kNone) << "what the dead one left is not a new writer";
  const TelemetrySegment third(name);
  EXPECT_EQ(follower.poll(ticks), Change::kAttached);
}

}  // namespace
}  // namespace ravencal::test
