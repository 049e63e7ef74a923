// SPDX-License-Identifier: Apache-2.0
//
// CAN frames to counts: layouts, wrap, CANopen states, errors, silence.
#include <gtest/gtest.h>

#include <algorithm>
#include <initializer_list>
#include <vector>

#include "core/constants.hpp"
#include "quadrature_reader/sources/can_clock.hpp"
#include "quadrature_reader/sources/can_decoder.hpp"

namespace ravencal::quadrature_reader {
namespace {

CanFrame frame(std::int64_t t_ns, std::uint32_t id, std::initializer_list<std::uint8_t> bytes) {
  CanFrame result;
  result.t_ns = t_ns;
  result.id = id;
  result.length = static_cast<std::uint8_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), result.data.begin());
  return result;
}

SourceSettings canopen_node_5() {
  SourceSettings settings;
  settings.kind = SourceKind::kCan;
  CanEncoder encoder;
  encoder.id = 0x185;
  encoder.canopen_node = 5;
  settings.can.push_back(encoder);
  return settings;
}

std::vector<Reading> take(CanDecoder& decoder, const CanFrame& input) {
  std::vector<Reading> out;
  decoder.take(input, out);
  return out;
}

std::vector<Reading> watch(CanDecoder& decoder, std::int64_t now_ns) {
  std::vector<Reading> out;
  decoder.watch(now_ns, out);
  return out;
}

TEST(CanDecoder, ReadsTheDefaultTpdoOfCia406) {
  CanDecoder decoder(canopen_node_5());
  const auto out = take(decoder, frame(7, 0x185, {0x40, 0xE2, 0x01, 0x00}));
  ASSERT_EQ(out.size(), 1U);
  EXPECT_EQ(out[0].kind, ReadingKind::kCount);
  EXPECT_EQ(out[0].value, 123'456);
  EXPECT_EQ(out[0].t_ns, 7);
}

TEST(CanDecoder, ReadsFreeLayouts) {
  CanEncoder layout;
  layout.byte_offset = 2;
  layout.byte_count = 3;
  layout.big_endian = true;
  layout.counter_bits = 20;
  const std::vector<std::uint8_t> data = {9, 9, 0xFA, 0xBC, 0xDE, 9};
  EXPECT_EQ(extract_count(layout, data), 0xABCDEU)
      << "the bits above the counter are not part of it";
  layout.big_endian = false;
  EXPECT_EQ(extract_count(layout, data), 0xEBCFAU);
  EXPECT_FALSE(extract_count(layout, std::span(data).first(4)));
}

TEST(CountWidener, FollowsTheCounterThroughItsWrapInBothDirections) {
  CountWidener counter(16);
  EXPECT_EQ(counter.widen(65'530, false), 65'530);
  EXPECT_EQ(counter.widen(4, false), 65'540);
  EXPECT_EQ(counter.widen(65'000, false), 65'000);
  CountWidener wide(64);
  EXPECT_EQ(wide.widen(~std::uint64_t{0}, true), -1);
  EXPECT_EQ(wide.widen(1, true), 1);
}

TEST(CountWidener, GoesOnFromTheLastCountAfterARestart) {
  CountWidener counter(32);
  counter.widen(1000, false);
  counter.reanchor();
  EXPECT_EQ(counter.widen(7, false), 1000);
  EXPECT_EQ(counter.widen(9, false), 1002);
}

TEST(CanDecoder, TellsANodeThatBeganAgain) {
  SourceSettings settings = canopen_node_5();
  settings.start_nodes = true;
  CanDecoder decoder(settings);
  EXPECT_TRUE(take(decoder, frame(0, 0x705, {0x00})).empty()) << "the first boot-up is normal";
  EXPECT_EQ(decoder.take_nodes_to_start(), std::vector<unsigned>{5});
  take(decoder, frame(1, 0x185, {100, 0, 0, 0}));
  const auto restart = take(decoder, frame(2, 0x705, {0x00}));
  ASSERT_EQ(restart.size(), 1U);
  EXPECT_EQ(restart[0].kind, ReadingKind::kRestarted);
  EXPECT_EQ(take(decoder, frame(3, 0x185, {5, 0, 0, 0}))[0].value, 100);
}

TEST(CanDecoder, TellsANodeThatIsNotOperational) {
  CanDecoder decoder(canopen_node_5());
  EXPECT_TRUE(take(decoder, frame(0, 0x705, {0x05})).empty());
  const auto stopped =
      take(decoder, frame(1, 0x705, {0x84}));  // with the toggle bit of node guarding
  ASSERT_EQ(stopped.size(), 1U);
  EXPECT_EQ(stopped[0].fault, Fault::kNodeStopped);
  EXPECT_TRUE(take(decoder, frame(2, 0x705, {0x04})).empty()) << "told once";
  EXPECT_EQ(take(decoder, frame(3, 0x705, {0x05}))[0].kind, ReadingKind::kRecovered);
}

TEST(CanDecoder, TellsASilentNodeOnceAndItsReturn) {
  SourceSettings settings = canopen_node_5();
  settings.position_timeout_ns = 50 * core::kNsPerMs;
  CanDecoder decoder(settings);
  EXPECT_TRUE(watch(decoder, 1000 * core::kNsPerMs).empty());
  take(decoder, frame(1010 * core::kNsPerMs, 0x185, {1, 0, 0, 0}));
  EXPECT_TRUE(watch(decoder, 1050 * core::kNsPerMs).empty());
  const auto silent = watch(decoder, 1061 * core::kNsPerMs);
  ASSERT_EQ(silent.size(), 1U);
  EXPECT_EQ(silent[0].kind, ReadingKind::kFault);
  EXPECT_EQ(silent[0].fault, Fault::kNodeSilent);
  EXPECT_TRUE(watch(decoder, 1100 * core::kNsPerMs).empty());
  const auto back = take(decoder, frame(1200 * core::kNsPerMs, 0x185, {2, 0, 0, 0}));
  ASSERT_EQ(back.size(), 2U);
  EXPECT_EQ(back[0].kind, ReadingKind::kRecovered);
}

TEST(CanDecoder, TellsAMissingHeartbeat) {
  SourceSettings settings = canopen_node_5();
  settings.heartbeat_timeout_ns = 500 * core::kNsPerMs;
  CanDecoder decoder(settings);
  EXPECT_TRUE(watch(decoder, 0).empty());
  take(decoder, frame(400 * core::kNsPerMs, 0x705, {0x05}));
  EXPECT_TRUE(watch(decoder, 800 * core::kNsPerMs).empty());
  EXPECT_EQ(watch(decoder, 901 * core::kNsPerMs).size(), 1U);
}

TEST(CanDecoder, TellsAMissingHeartbeatOnceWhilePositionsGoOn) {
  SourceSettings settings = canopen_node_5();
  settings.heartbeat_timeout_ns = 500 * core::kNsPerMs;
  settings.position_timeout_ns = 50 * core::kNsPerMs;
  CanDecoder decoder(settings);
  int faults = 0;
  for (std::int64_t t_ms = 0; t_ms < 2000; t_ms += 10) {
    for (const auto& out : {take(decoder, frame(t_ms * core::kNsPerMs, 0x185, {1, 0, 0, 0})),
                            watch(decoder, t_ms * core::kNsPerMs)}) {
      for (const auto& reading : out) {
        if (reading.kind == ReadingKind::kCount) continue;
        EXPECT_EQ(reading.fault, Fault::kHeartbeatLate);
        ++faults;
      }
    }
  }
  EXPECT_EQ(faults, 1);
  const auto back = take(decoder, frame(2000 * core::kNsPerMs, 0x705, {0x05}));
  ASSERT_EQ(back.size(), 1U);
  EXPECT_EQ(back[0].kind, ReadingKind::kRecovered);
  EXPECT_EQ(back[0].fault, Fault::kHeartbeatLate);
}

SourceSettings limited_node_5() {
  SourceSettings settings = canopen_node_5();
  settings.can[0].max_counts_per_s = 10'000;
  return settings;
}

TEST(CanDecoder, MakesACorruptPositionAnEventAndNotAJump) {
  CanDecoder decoder(limited_node_5());
  take(decoder, frame(0, 0x185, {100, 0, 0, 0}));
  const auto corrupt = take(decoder, frame(10 * core::kNsPerMs, 0x185, {100, 0, 64, 0}));
  ASSERT_EQ(corrupt.size(), 1U);
  EXPECT_EQ(corrupt[0].kind, ReadingKind::kLost);
  EXPECT_EQ(corrupt[0].fault, Fault::kImplausibleCount);
  const auto next = take(decoder, frame(20 * core::kNsPerMs, 0x185, {120, 0, 0, 0}));
  ASSERT_EQ(next.size(), 1U);
  EXPECT_EQ(next[0].kind, ReadingKind::kCount);
  EXPECT_EQ(next[0].value, 120);
}

TEST(CanDecoder, BelievesTheFastestMotionThatItsLimitAllows) {
  CanDecoder decoder(limited_node_5());
  for (std::uint8_t i = 0; i < 20; ++i) {
    const unsigned count = 100U * i;  // 10 000 counts/s
    const auto out = take(decoder, frame(i * 10 * core::kNsPerMs, 0x185,
                                         {static_cast<std::uint8_t>(count),
                                          static_cast<std::uint8_t>(count >> 8U), 0, 0}));
    ASSERT_EQ(out.size(), 1U);
    EXPECT_EQ(out[0].value, count);
  }
}

TEST(CanDecoder, RecognisesANodeThatBeganAgainWithoutSayingSo) {
  CanDecoder decoder(limited_node_5());
  take(decoder, frame(0, 0x185, {0, 0, 64, 0}));
  EXPECT_EQ(take(decoder, frame(10 * core::kNsPerMs, 0x185, {7, 0, 0, 0}))[0].kind,
            ReadingKind::kLost);
  EXPECT_EQ(take(decoder, frame(20 * core::kNsPerMs, 0x185, {8, 0, 0, 0}))[0].kind,
            ReadingKind::kLost);
  const auto out = take(decoder, frame(30 * core::kNsPerMs, 0x185, {9, 0, 0, 0}));
  ASSERT_EQ(out.size(), 2U);
  EXPECT_EQ(out[0].kind, ReadingKind::kRestarted);
  EXPECT_EQ(out[1].value, 64 << 16) << "the count goes on from where it was";
  EXPECT_EQ(take(decoder, frame(40 * core::kNsPerMs, 0x185, {12, 0, 0, 0}))[0].value,
            (64 << 16) + 3);
}

TEST(CanDecoder, SaysSoWhenASmallCounterMayHaveWrappedInASilence) {
  SourceSettings settings = limited_node_5();
  settings.position_timeout_ns = 50 * core::kNsPerMs;
  settings.can[0].byte_count = 2;
  settings.can[0].counter_bits = 16;  // half of its range is 3.3 s of the fastest motion
  CanDecoder decoder(settings);
  watch(decoder, 0);
  take(decoder, frame(0, 0x185, {1, 0}));
  watch(decoder, 1000 * core::kNsPerMs);
  const auto soon = take(decoder, frame(1000 * core::kNsPerMs, 0x185, {2, 0}));
  ASSERT_EQ(soon.size(), 2U);
  EXPECT_EQ(soon[0].kind, ReadingKind::kRecovered);
  watch(decoder, 5000 * core::kNsPerMs);
  const auto late = take(decoder, frame(5000 * core::kNsPerMs, 0x185, {3, 0}));
  ASSERT_EQ(late.size(), 3U);
  EXPECT_EQ(late[1].kind, ReadingKind::kRestarted);
  EXPECT_EQ(late[2].kind, ReadingKind::kCount);
}

TEST(CanDecoder, ReadsTheFarEndOfAnFdFrameWithA29BitIdentifier) {
  SourceSettings settings;
  settings.kind = SourceKind::kCan;
  CanEncoder encoder;
  encoder.id = 0x1F334455;
  encoder.extended = true;
  encoder.byte_offset = 60;
  settings.can.push_back(encoder);
  CanDecoder decoder(settings);
  CanFrame fd = frame(1, kCanExtendedFlag | 0x1F334455, {});
  fd.length = 64;
  fd.data[60] = 0x11;
  fd.data[63] = 0x01;
  const auto out = take(decoder, fd);
  ASSERT_EQ(out.size(), 1U);
  EXPECT_EQ(out[0].value, 0x01000011);
  EXPECT_TRUE(take(decoder, frame(2, 0x455, {1, 0, 0, 0})).empty()) << "the lower 11 bits alone";
}

TEST(CanClock, TakesTheKernelsVaryingDelayOutOfTheStamps) {
  CanClock clock;
  constexpr std::int64_t kOffset = 1'000'000'000'000;
  constexpr std::int64_t kShortest = 20'000;
  std::uint32_t noise = 1;
  for (std::int64_t i = 0; i < 5000; ++i) {
    noise = noise * 1664525U + 1013904223U;
    const std::int64_t adapter_ns = i * core::kNsPerMs;
    const std::int64_t true_ns = adapter_ns + kOffset + i * 50;  // the adapter's clock: 50 ppm slow
    const std::int64_t kernel_ns = true_ns + kShortest + noise % 400'000;
    const std::int64_t t_ns = clock.to_monotonic(adapter_ns, kernel_ns);
    ASSERT_LE(t_ns, kernel_ns);
    // After a few frames: the shortest way, late by what no short frame came for, early by the
    // drift of a second.
    if (i <= 100) continue;
    ASSERT_NEAR(static_cast<double>(t_ns - true_ns), kShortest, 60'000.0) << i;
  }
}

TEST(CanClock, StartsAgainWhenTheAdaptersClockDoes) {
  CanClock clock;
  clock.to_monotonic(5'000 * core::kNsPerMs, 10'000 * core::kNsPerMs);
  EXPECT_EQ(clock.to_monotonic(1 * core::kNsPerMs, 10'001 * core::kNsPerMs),
            10'001 * core::kNsPerMs);
  EXPECT_EQ(clock.to_monotonic(2 * core::kNsPerMs, 10'003 * core::kNsPerMs),
            10'002 * core::kNsPerMs);
  EXPECT_EQ(clock.to_monotonic(9'000 * core::kNsPerMs, 10'004 * core::kNsPerMs),
            10'004 * core::kNsPerMs);
}

TEST(CanDecoder, TellsBusOffItsEndAndErrorFrames) {
  CanDecoder decoder(canopen_node_5());
  EXPECT_EQ(take(decoder, frame(0, kCanErrorFlag | 0x40, {}))[0].fault, Fault::kBusOff);
  EXPECT_EQ(take(decoder, frame(1, kCanErrorFlag | 0x100, {}))[0].kind, ReadingKind::kRecovered);
  const auto error = take(decoder, frame(2, kCanErrorFlag | 0x88, {0, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(error[0].fault, Fault::kBusError);
  EXPECT_EQ(error[0].value, 0x88);
}

TEST(CanDecoder, IgnoresRequestsOtherFormatsAndReportsShortFrames) {
  CanDecoder decoder(canopen_node_5());
  EXPECT_TRUE(take(decoder, frame(0, kCanRemoteFlag | 0x185, {})).empty());
  EXPECT_TRUE(take(decoder, frame(0, kCanExtendedFlag | 0x185, {1, 0, 0, 0})).empty());
  EXPECT_EQ(take(decoder, frame(0, 0x185, {1, 0}))[0].fault, Fault::kShortFrame);
}

}  // namespace
}  // namespace ravencal::quadrature_reader
