// SPDX-License-Identifier: Apache-2.0
//
// CLOCK_MONOTONIC, the clock of every time stamp and of every periodic thread. Any thread.
#pragma once

#include <time.h>

#include <cerrno>
#include <cstdint>

namespace ravencal::core {

inline constexpr std::int64_t kSecondNs = 1'000'000'000;

inline std::int64_t monotonic_now_ns() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kSecondNs + now.tv_nsec;
}

/// Returns at the deadline, or at once if that has passed; signals do not shorten the sleep.
inline void sleep_until(std::int64_t deadline_ns) {
  const timespec deadline{deadline_ns / kSecondNs, deadline_ns % kSecondNs};
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr) == EINTR) {
  }
}

}  // namespace ravencal::core
