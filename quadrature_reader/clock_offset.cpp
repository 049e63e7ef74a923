// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/clock_offset.hpp"

#include <ctime>

namespace ravencal::quadrature_reader {
namespace {

std::int64_t read_clock_ns(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

}  // namespace

ClockOffset measure_realtime_offset() {
  constexpr int kTries = 8;
  ClockOffset best;
  best.uncertainty_ns = INT64_MAX;
  for (int i = 0; i < kTries; ++i) {
    const std::int64_t before = read_clock_ns(CLOCK_MONOTONIC);
    const std::int64_t real = read_clock_ns(CLOCK_REALTIME);
    const std::int64_t after = read_clock_ns(CLOCK_MONOTONIC);
    const std::int64_t half = (after - before) / 2;
    if (half < best.uncertainty_ns) best = {before + half, real - before - half, half};
  }
  return best;
}

}  // namespace ravencal::quadrature_reader
