// SPDX-License-Identifier: Apache-2.0
//
// One encoder as a whole: samples between edges, velocity from their timing, slips at the index.
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <cstdlib>
#include <vector>

#include "core/constants.hpp"
#include "quadrature_reader/axis.hpp"
#include "quadrature_reader/encode.hpp"

namespace ravencal::quadrature_reader {
namespace {

AxisSettings counts_are_units() {
  AxisSettings settings;
  settings.joint = "shoulder";
  settings.si_per_count = 1.0;
  settings.zero_counts = 0;
  return settings;
}

/// Feeds readings and takes a sample each millisecond, as the recorder does.
std::vector<AxisSample> samples_of(Axis& axis, const std::vector<Reading>& readings,
                                   std::int64_t until_ns) {
  std::vector<AxisSample> samples;
  AxisUpdate update;
  std::size_t next = 0;
  for (std::int64_t t = 0; t <= until_ns; t += core::kNsPerMs) {
    const std::int64_t known_ns = t + axis.settings().latency_ns;
    while (next < readings.size() && readings[next].t_ns <= known_ns) axis.push(readings[next++]);
    axis.push({known_ns, 0, 0, ReadingKind::kAlive, Line::kA, Fault::kNone});
    while (axis.pop(update)) {
    }
    samples.push_back(axis.sample(t));
  }
  return samples;
}

RC_GTEST_PROP(AxisProperty, SamplesAreTheLineBetweenEdgesAtThatInstant, ()) {
  // At a steady speed of at least an edge per 5 ms the count at any instant is known exactly.
  const double speed = *rc::gen::inRange(200, 20'000) * (*rc::gen::arbitrary<bool>() ? 1.0 : -1.0);
  const std::vector<std::int64_t> t_ns = {0, 1000 * core::kNsPerMs};
  const std::vector<double> x = {0.0, speed};
  Axis axis(counts_are_units());
  const auto samples = samples_of(axis, encode_motion(t_ns, x, {}), 900 * core::kNsPerMs);
  for (std::size_t ms = 50; ms < samples.size(); ++ms) {
    RC_ASSERT(samples[ms].position_valid);
    // Stamps are whole nanoseconds.
    RC_ASSERT(std::abs(samples[ms].position_si - 1e-3 * speed * static_cast<double>(ms)) < 1e-3);
  }
}

RC_GTEST_PROP(AxisProperty, VelocityComesFromTheTimingOfEdges, ()) {
  const double speed = *rc::gen::inRange(300, 20'000) * (*rc::gen::arbitrary<bool>() ? 1.0 : -1.0);
  // Unequal phases: every edge of the cycle is off by its own share of a count, as on real discs.
  std::vector<double> off;
  for (int i = 0; i < 4; ++i) off.push_back(0.002 * *rc::gen::inRange(-100, 101));
  const std::vector<std::int64_t> t_ns = {0, 1000 * core::kNsPerMs};
  const std::vector<double> x = {0.0, speed};
  auto readings = encode_motion(t_ns, x, {});
  for (std::size_t i = 1; i < readings.size(); ++i)
    readings[i].t_ns += std::llround(1e9 * off[i % 4] / std::abs(speed));
  Axis axis(counts_are_units());
  const auto samples = samples_of(axis, readings, 900 * core::kNsPerMs);
  for (std::size_t ms = 50; ms < samples.size(); ++ms)
    // A difference of counts over a millisecond would be off by up to 1000 counts/s.
    RC_ASSERT(std::abs(samples[ms].velocity_si - speed) < 1e-4 * std::abs(speed));
}

RC_GTEST_PROP(AxisProperty, ASlipIsToldAtTheNextIndexWithItsAmount, ()) {
  constexpr std::int64_t kRev = 400;
  AxisSettings settings = counts_are_units();
  settings.index = IndexSettings{kRev, 2};
  // Whole cycles that vanish leave A and B consistent: only the index can tell.
  const auto cycles = *rc::gen::inRange<std::int64_t>(1, 40);
  const double direction = *rc::gen::element(-1.0, 1.0);
  const std::vector<std::int64_t> t_ns = {0, 4000 * core::kNsPerMs};
  const std::vector<double> x = {direction * 10.0, direction * 2010.0};
  auto readings = encode_motion(t_ns, x, {1.0, kRev, 0});
  const auto from = *rc::gen::inRange<std::int64_t>(500, 700);
  std::vector<Reading> kept;
  std::int64_t edges = 0;
  std::int64_t lost_at_ns = 0;
  for (const auto& reading : readings) {
    const bool ab = reading.kind == ReadingKind::kEdge && reading.line != Line::kZ;
    if (ab && ++edges > from && edges <= from + 4 * cycles) {
      if (lost_at_ns == 0) lost_at_ns = reading.t_ns;
      continue;
    }
    kept.push_back(reading);
  }
  Axis axis(settings);
  (void)samples_of(axis, kept, 4100 * core::kNsPerMs);
  std::int64_t slipped = 0;
  int slips = 0;
  for (const auto& event : axis.events()) {
    if (event.kind != AxisEventKind::kIndexSlip) continue;
    ++slips;
    slipped += event.amount;
    RC_ASSERT(event.to_ns >= lost_at_ns);
    // 500 counts per second: the next index is at most a turn and the loss away.
    RC_ASSERT(event.to_ns - lost_at_ns <= (2 * kRev + 4 * cycles + 8) * 2 * core::kNsPerMs);
  }
  // An index pulse within the loss tells its first part, the next one the rest.
  RC_ASSERT(slips == 1 || slips == 2);
  RC_ASSERT(std::abs(slipped + std::llround(direction) * 4 * cycles) <=
            settings.index->tolerance_counts);
}

}  // namespace
}  // namespace ravencal::quadrature_reader
