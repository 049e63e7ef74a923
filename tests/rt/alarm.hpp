// SPDX-License-Identifier: Apache-2.0
//
// Counts heap use between arm() and disarm(), the loaded plugin's included: the test program
// defines malloc and its kin itself, and every shared object in the process binds to them. (Eigen's
// own no-malloc macros are asserts and catch nothing under NDEBUG.) Not for builds with ASan.
#pragma once

#include <cstdint>

namespace ravencal::test {

/// From here on, heap calls of this thread are counted.
void arm_heap_alarm();
/// Ends the count; returns the heap calls since arm_heap_alarm.
std::uint64_t disarm_heap_alarm();

}  // namespace ravencal::test
