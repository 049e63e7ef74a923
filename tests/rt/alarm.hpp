// SPDX-License-Identifier: Apache-2.0
//
// Counts heap and lock calls between arm() and disarm(), the loaded plugin's included: the test
// program defines malloc, pthread_mutex_lock and their kin itself, and every shared object in the
// process binds to them. (Eigen's own no-malloc macros are asserts and catch nothing under NDEBUG.)
// Not for builds with sanitizers, which do the same. Locks that are taken without these functions
// show as futex calls, once they have to wait: system_call_alarm.hpp.
#pragma once

#include <cstdint>

namespace ravencal::test {

struct AlarmCounts {
  std::uint64_t heap = 0;   ///< malloc, free and kin
  std::uint64_t locks = 0;  ///< mutexes, read-write and spin locks, semaphores
};

/// From here on, calls of this thread are counted.
void arm_alarms();
/// Ends the count; returns the calls since arm_alarms.
AlarmCounts disarm_alarms();

/// The same for programs that look at the heap only.
inline void arm_heap_alarm() { arm_alarms(); }
inline std::uint64_t disarm_heap_alarm() { return disarm_alarms().heap; }

}  // namespace ravencal::test
