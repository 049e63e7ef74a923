// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "core/spsc_ring.hpp"
#include "quadrature_reader/decoder.hpp"
#include "quadrature_reader/encode.hpp"
#include "quadrature_reader/glitch_filter.hpp"
#include "quadrature_reader/index_check.hpp"

namespace ravencal::quadrature_reader {
namespace {

Reading edge(std::int64_t t_ns, Line line, int level) {
  return {t_ns, level, 0, ReadingKind::kEdge, line, Fault::kNone};
}

TEST(Decoder, CountsOneStepPerEdgeInBothDirections) {
  QuadratureDecoder decoder;
  decoder.on_levels(false, false);
  decoder.on_edge(Line::kA, true);
  decoder.on_edge(Line::kB, true);
  decoder.on_edge(Line::kA, false);
  EXPECT_EQ(decoder.count(), 3);
  decoder.on_edge(Line::kA, true);
  decoder.on_edge(Line::kB, false);
  decoder.on_edge(Line::kA, false);
  EXPECT_EQ(decoder.count(), 0);
}

TEST(Decoder, CannotSeeALossOfWholeCycles) {
  // Stated, not hidden: four edges less leave A and B consistent. Sequence numbers or the index
  // find this; see Axis.FindsLostCountsAtTheIndex and the property BridgesACountedLoss.
  QuadratureDecoder decoder;
  decoder.on_levels(false, false);
  decoder.on_edge(Line::kA, true);
  EXPECT_EQ(decoder.on_levels(true, false).kind, DecoderStep::Kind::kNone);
  EXPECT_EQ(decoder.uncertainty_counts(), 0);
}

TEST(Decoder, KeepsWithinItsBoundWhenACountedLossHidesAReversal) {
  QuadratureDecoder decoder;
  decoder.on_levels(false, false);
  decoder.on_edge(Line::kA, true);  // 1
  decoder.on_lost(2);               // in truth: forth and back
  decoder.on_levels(true, false);
  EXPECT_EQ(decoder.count(), 1);
  EXPECT_GE(decoder.uncertainty_counts(), 2);
}

TEST(GlitchFilter, RemovesShortPulsesAndKeepsLongOnes) {
  GlitchFilter filter(1000);
  filter.push(edge(0, Line::kA, 1));
  filter.push(edge(5000, Line::kB, 1));
  filter.push(edge(5400, Line::kB, 0));
  filter.push(edge(9000, Line::kA, 0));
  filter.advance(20'000);
  std::vector<std::int64_t> times;
  for (Reading reading; filter.pop(reading);) times.push_back(reading.t_ns);
  EXPECT_EQ(times, (std::vector<std::int64_t>{0, 9000}));
  EXPECT_EQ(filter.removed_pulses(), 1);
}

TEST(GlitchFilter, KeepsTheOrderOfLinesAcrossAPulse) {
  GlitchFilter filter(1000);
  filter.push(edge(0, Line::kA, 1));
  filter.push(edge(100, Line::kB, 1));
  filter.push(edge(200, Line::kA, 0));
  filter.push({250, 1, 0, ReadingKind::kLevels, Line::kA, Fault::kNone});
  Reading reading;
  ASSERT_TRUE(filter.pop(reading));
  EXPECT_EQ(reading.t_ns, 100);
  ASSERT_TRUE(filter.pop(reading));
  EXPECT_EQ(reading.kind, ReadingKind::kLevels);
  EXPECT_FALSE(filter.pop(reading));
}

TEST(IndexCheck, ReportsASlipOnceAndInBothDirections) {
  IndexCheck check(1000, 2);
  EXPECT_TRUE(check.on_edge(true, 1, 7)->first);
  EXPECT_EQ(check.on_edge(true, 1, 1007)->slip_counts, 0);
  EXPECT_FALSE(check.on_edge(false, 1, 1009)) << "the upper flank does not count";
  EXPECT_EQ(check.on_edge(true, 1, 2019)->slip_counts, 12);
  EXPECT_EQ(check.on_edge(false, -1, 1019)->slip_counts, 0);
  EXPECT_EQ(check.on_edge(false, -1, 14)->slip_counts, -5);
  EXPECT_FALSE(check.on_edge(true, 0, 14)) << "no direction, no flank";
}

TEST(EncodeMotion, StartsWithTheLevelsAndRaisesTheIndexOncePerTurn) {
  const auto readings = encode_motion(std::vector<std::int64_t>{0, 1'000'000'000},
                                      std::vector<double>{2.0, 25.0}, {1.0, 10, 3});
  EXPECT_EQ(readings.front().kind, ReadingKind::kLevels);
  EXPECT_EQ(readings.front().value, 3);
  int index_edges = 0;
  for (const auto& reading : readings) {
    EXPECT_EQ(reading.axis, 3);
    index_edges += reading.kind == ReadingKind::kEdge && reading.line == Line::kZ ? 1 : 0;
  }
  EXPECT_EQ(index_edges, 4);
  EXPECT_EQ(readings.size(), 1U + 23U + 4U);
}

TEST(SpscRing, RefusesWhenFullAndHandsOutInOrder) {
  core::SpscRing<int> ring(3);
  EXPECT_EQ(ring.capacity(), 4U);
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(ring.try_push(i));
  EXPECT_FALSE(ring.try_push(4));
  int out = 0;
  for (int i = 0; i < 4; ++i) {
    ASSERT_TRUE(ring.try_pop(out));
    EXPECT_EQ(out, i);
  }
  EXPECT_FALSE(ring.try_pop(out));
}

TEST(SpscRing, CarriesEverythingBetweenTwoThreads) {
  core::SpscRing<std::int64_t> ring(64);
  constexpr std::int64_t kItems = 200'000;
  std::thread producer([&] {
    for (std::int64_t i = 0; i < kItems;) {
      if (ring.try_push(i)) {
        ++i;
      } else {
        std::this_thread::yield();
      }
    }
  });
  std::int64_t expected = 0;
  for (std::int64_t item = 0; expected < kItems;) {
    if (!ring.try_pop(item)) {
      std::this_thread::yield();
      continue;
    }
    ASSERT_EQ(item, expected);
    ++expected;
  }
  producer.join();
}

}  // namespace
}  // namespace ravencal::quadrature_reader
