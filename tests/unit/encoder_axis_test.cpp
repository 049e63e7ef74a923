// SPDX-License-Identifier: Apache-2.0
//
// One encoder from edges to joint positions: accuracy, rest, losses, index.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/constants.hpp"
#include "quadrature_reader/axis.hpp"
#include "quadrature_reader/encode.hpp"

namespace ravencal::quadrature_reader {
namespace {

constexpr double kRadPerCount = 2.0 * std::numbers::pi / 80'000.0;

AxisSettings shoulder() {
  AxisSettings settings;
  settings.joint = "shoulder";
  settings.si_per_count = kRadPerCount;
  settings.zero_counts = 0;
  return settings;
}

/// A joint that swings by +-10 deg at 0.3 Hz, sampled finely.
struct Swing {
  std::vector<std::int64_t> t_ns;
  std::vector<double> position_rad;
  explicit Swing(double seconds) {
    for (std::int64_t t = 0; t <= static_cast<std::int64_t>(seconds * 1e9);
         t += core::kNsPerMs / 10) {
      t_ns.push_back(t);
      position_rad.push_back(position_at(t));
    }
  }
  static double phase(std::int64_t t) {
    return 2.0 * std::numbers::pi * 0.3 * static_cast<double>(t) * 1e-9;
  }
  static double position_at(std::int64_t t) { return 0.1745 * std::sin(phase(t)); }
  static double velocity_at(std::int64_t t) {
    return 0.1745 * 2.0 * std::numbers::pi * 0.3 * std::cos(phase(t));
  }
};

void feed(Axis& axis, const std::vector<Reading>& readings) {
  AxisUpdate update;
  for (const auto& reading : readings) {
    axis.push(reading);
    while (axis.pop(update)) {
    }
  }
}

std::vector<Reading> edges_of(const Swing& swing, std::int64_t index_counts = 0) {
  return encode_motion(swing.t_ns, swing.position_rad, {1.0 / kRadPerCount, index_counts, 0});
}

int events_of_kind(const Axis& axis, AxisEventKind kind) {
  return static_cast<int>(
      std::count_if(axis.events().begin(), axis.events().end(),
                    [kind](const AxisEvent& event) { return event.kind == kind; }));
}

TEST(Axis, GivesThePositionAtAnyInstantToHalfACount) {
  const Swing swing(4.0);
  Axis axis(shoulder());
  feed(axis, edges_of(swing));
  double worst_counts = 0.0;
  double sum_squares = 0.0;
  int samples = 0;
  for (std::int64_t t = 0; t <= 3900 * core::kNsPerMs; t += core::kNsPerMs) {
    const AxisSample sample = axis.sample(t);
    ASSERT_TRUE(sample.position_valid) << t;
    const double error = (sample.position_si - Swing::position_at(t)) / kRadPerCount;
    worst_counts = std::max(worst_counts, std::abs(error));
    sum_squares += error * error;
    ++samples;
  }
  // Half a count where it rests or turns; between the edges of a motion, interpolation does better
  // than the 0.29 counts of plain rounding.
  EXPECT_LE(worst_counts, 0.51);
  EXPECT_LT(std::sqrt(sum_squares / samples), 0.1);
}

TEST(Axis, TakesTheVelocityFromTheTimingOfEdges) {
  const Swing swing(1.0);
  Axis axis(shoulder());
  feed(axis, edges_of(swing));
  // 0.33 rad/s, 4200 edges/s; differencing counts over 1 ms would be off by up to 0.08 rad/s.
  for (std::int64_t t = 20 * core::kNsPerMs; t <= 400 * core::kNsPerMs; t += core::kNsPerMs) {
    EXPECT_NEAR(axis.sample(t).velocity_si, Swing::velocity_at(t), 0.002) << t;
  }
}

TEST(Axis, RestsAtTheCountAndHasNoVelocityThere) {
  Axis axis(shoulder());
  const std::vector<std::int64_t> t_ns = {0, 100 * core::kNsPerMs, 1000 * core::kNsPerMs,
                                          1100 * core::kNsPerMs};
  const std::vector<double> counts = {0.0, 10.0, 10.0, 20.0};
  feed(axis, encode_motion(t_ns, counts, {}));
  const AxisSample sample = axis.sample(500 * core::kNsPerMs);
  EXPECT_TRUE(sample.counts_valid);
  EXPECT_EQ(sample.counts, 10.0);
  EXPECT_EQ(sample.velocity_si, 0.0);
}

TEST(Axis, AppliesSignAndZero) {
  AxisSettings settings = shoulder();
  settings.sign = -1;
  settings.zero_counts = 4;
  settings.zero_position_si = 1.5;
  Axis axis(settings);
  feed(axis, encode_motion(std::vector<std::int64_t>{0, 100 * core::kNsPerMs},
                           std::vector<double>{0.0, 10.0}, {}));
  EXPECT_NEAR(axis.sample(200 * core::kNsPerMs).position_si, 1.5 - 6.0 * kRadPerCount, 1e-15);
}

TEST(Axis, WithholdsThePositionUntilTheZeroIsKnown) {
  AxisSettings settings = shoulder();
  settings.zero_counts.reset();
  Axis axis(settings);
  feed(axis, edges_of(Swing(0.2)));
  EXPECT_TRUE(axis.sample(50 * core::kNsPerMs).counts_valid);
  EXPECT_FALSE(axis.sample(60 * core::kNsPerMs).position_valid);
  axis.set_zero(0, 0.0);
  EXPECT_TRUE(axis.sample(70 * core::kNsPerMs).position_valid);
}

TEST(Axis, BlanksTheGapOfALostEdgeAndGoesOnRight) {
  const Swing swing(1.0);
  auto readings = edges_of(swing);
  const auto lost = readings.begin() + 1000;
  const std::int64_t t_lost = lost->t_ns;
  readings.erase(lost);
  Axis axis(shoulder());
  feed(axis, readings);
  EXPECT_EQ(events_of_kind(axis, AxisEventKind::kEdgeRepaired), 1);
  EXPECT_FALSE(axis.sample(t_lost).counts_valid);
  const AxisSample later = axis.sample(t_lost + 10 * core::kNsPerMs);
  ASSERT_TRUE(later.position_valid);
  EXPECT_NEAR(later.position_si, Swing::position_at(t_lost + 10 * core::kNsPerMs), kRadPerCount);
}

TEST(Axis, WithholdsThePositionAfterAnUncountedLoss) {
  const Swing swing(1.0);
  auto readings = edges_of(swing);
  const auto at = readings.begin() + 1000;
  const std::int64_t t_lost = at->t_ns;
  readings.insert(at, {t_lost, 0, 0, ReadingKind::kLost, Line::kA, Fault::kQueueOverflow});
  Axis axis(shoulder());
  feed(axis, readings);
  EXPECT_EQ(events_of_kind(axis, AxisEventKind::kEdgesLost), 1);
  const AxisSample later = axis.sample(t_lost + 50 * core::kNsPerMs);
  EXPECT_TRUE(later.counts_valid);
  EXPECT_FALSE(later.position_valid);
}

TEST(Axis, FindsLostCountsAtTheIndex) {
  AxisSettings settings = shoulder();
  settings.index = IndexSettings{1000, 2};
  Axis axis(settings);
  auto readings = edges_of(Swing(1.0), 1000);
  // Two whole cycles vanish: A and B stay consistent, only the index can tell.
  std::vector<Reading> kept;
  int dropped = 0;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const bool drop = i > 1200 && dropped < 8 && readings[i].line != Line::kZ;
    dropped += drop ? 1 : 0;
    if (!drop) kept.push_back(readings[i]);
  }
  feed(axis, kept);
  ASSERT_EQ(events_of_kind(axis, AxisEventKind::kIndexSlip), 1);
  const auto slip =
      std::find_if(axis.events().begin(), axis.events().end(),
                   [](const AxisEvent& event) { return event.kind == AxisEventKind::kIndexSlip; });
  EXPECT_EQ(slip->amount, -8);
}

TEST(Axis, GivesThePositionAgainOnceTheIndexHasToldTheLoss) {
  AxisSettings settings = shoulder();
  settings.index = IndexSettings{1000, 0};
  Axis axis(settings);
  auto readings = edges_of(Swing(0.8), 1000);
  std::vector<Reading> kept;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const bool lost = i >= 1203 && i < 1303;
    if (i == 1303)
      kept.push_back({readings[i].t_ns, 0, 0, ReadingKind::kLost, Line::kA, Fault::kNone});
    if (!lost) kept.push_back(readings[i]);
  }
  feed(axis, kept);
  const AxisSample last = axis.sample(780 * core::kNsPerMs);
  ASSERT_TRUE(last.position_valid);
  EXPECT_NEAR(last.position_si, Swing::position_at(780 * core::kNsPerMs), kRadPerCount);
}

TEST(Axis, BlanksAnOutageOfTheDevice) {
  const Swing swing(1.0);
  auto readings = edges_of(swing);
  Axis axis(shoulder());
  std::vector<Reading> before;
  std::vector<Reading> after;
  for (const auto& reading : readings) {
    if (reading.t_ns < 300 * core::kNsPerMs) before.push_back(reading);
    if (reading.t_ns > 600 * core::kNsPerMs) after.push_back(reading);
  }
  feed(axis, before);
  feed(axis,
       {{300 * core::kNsPerMs, 19, kEveryAxis, ReadingKind::kFault, Line::kA, Fault::kDeviceGone},
        {599 * core::kNsPerMs, 0, kEveryAxis, ReadingKind::kRecovered, Line::kA,
         Fault::kDeviceGone}});
  feed(axis, after);
  EXPECT_EQ(events_of_kind(axis, AxisEventKind::kOutage), 1);
  EXPECT_TRUE(axis.sample(299 * core::kNsPerMs).position_valid);
  EXPECT_FALSE(axis.sample(400 * core::kNsPerMs).counts_valid);
  const AxisSample later = axis.sample(700 * core::kNsPerMs);
  EXPECT_TRUE(later.counts_valid);
  EXPECT_FALSE(later.position_valid) << "nobody knows how far it moved meanwhile";
}

TEST(Axis, TakesCountsOfADeviceAsTheyAreAndBlanksSilence) {
  AxisSettings settings = shoulder();
  settings.stale_ns = 50 * core::kNsPerMs;
  Axis axis(settings);
  std::vector<Reading> readings;
  for (std::int64_t t = 0; t <= 1000 * core::kNsPerMs; t += 10 * core::kNsPerMs) {
    if (t > 300 * core::kNsPerMs && t < 600 * core::kNsPerMs) continue;
    readings.push_back({t, t / core::kNsPerMs, 0, ReadingKind::kCount, Line::kA, Fault::kNone});
  }
  feed(axis, readings);
  EXPECT_NEAR(axis.sample(105 * core::kNsPerMs).counts, 105.0, 1e-9);
  EXPECT_NEAR(axis.sample(106 * core::kNsPerMs).velocity_si, 1000.0 * kRadPerCount, 1e-9);
  EXPECT_FALSE(axis.sample(450 * core::kNsPerMs).counts_valid);
  EXPECT_TRUE(axis.sample(650 * core::kNsPerMs).position_valid)
      << "the device went on counting by itself";
}

TEST(Axis, WithholdsThePositionAfterADeviceBeganAgain) {
  AxisSettings settings = shoulder();
  settings.stale_ns = 50 * core::kNsPerMs;
  Axis axis(settings);
  feed(axis, {{0, 100, 0, ReadingKind::kCount, Line::kA, Fault::kNone},
              {10 * core::kNsPerMs, 0, 0, ReadingKind::kRestarted, Line::kA, Fault::kNone},
              {20 * core::kNsPerMs, 100, 0, ReadingKind::kCount, Line::kA, Fault::kNone}});
  EXPECT_EQ(events_of_kind(axis, AxisEventKind::kRestarted), 1);
  const AxisSample sample = axis.sample(25 * core::kNsPerMs);
  EXPECT_TRUE(sample.counts_valid);
  EXPECT_FALSE(sample.position_valid);
}

}  // namespace
}  // namespace ravencal::quadrature_reader
