// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/stopwatch.hpp"

#include <time.h>

namespace ravencal::rt {
namespace {

constexpr std::int64_t kCalibrationNs = 2'000'000;

std::int64_t clock_ns() noexcept {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

/// Both clocks at one moment.
struct Reading {
  std::int64_t clock_ns = 0;
  std::uint64_t counter = 0;
};

/// The closest of a few pairs: an interrupt between the two readings spoils one of them only.
Reading read_both() noexcept {
  constexpr int kAttempts = 8;
  Reading best;
  std::int64_t narrowest_ns = INT64_MAX;
  for (int i = 0; i < kAttempts; ++i) {
    const std::int64_t before_ns = clock_ns();
    const std::uint64_t counter = Stopwatch::now();
    const std::int64_t width_ns = clock_ns() - before_ns;
    if (width_ns >= narrowest_ns) continue;
    narrowest_ns = width_ns;
    best = {before_ns + width_ns / 2, counter};
  }
  return best;
}

}  // namespace

Stopwatch::Stopwatch() noexcept {
  const Reading first = read_both();
  const timespec pause{0, kCalibrationNs};
  ::nanosleep(&pause, nullptr);
  const Reading second = read_both();
  const auto ticks = static_cast<std::int64_t>(second.counter - first.counter);
  if (ticks <= 0) return;
  scale_ = (static_cast<std::uint64_t>(second.clock_ns - first.clock_ns) << kScaleBits) /
           static_cast<std::uint64_t>(ticks);
}

}  // namespace ravencal::rt
