// SPDX-License-Identifier: Apache-2.0
//
// Time stamps of a CAN adapter's own clock, brought to CLOCK_MONOTONIC. The adapter stamps a frame
// when it ends on the bus, the kernel when it arrives there some varying time later; the smallest
// difference over the last second is the clocks' offset plus the shortest way. An adapter clock
// that is 100 ppm off drifts 0.1 ms in that second. Not thread-safe.
#pragma once

#include <cstdint>

namespace ravencal::quadrature_reader {

class CanClock {
 public:
  /// The frame's stamps by the adapter and, on CLOCK_MONOTONIC, by the kernel; both in ns. The
  /// result is on CLOCK_MONOTONIC and never later than `kernel_ns`.
  std::int64_t to_monotonic(std::int64_t adapter_ns, std::int64_t kernel_ns);

 private:
  static constexpr std::int64_t kHalfWindowNs = 500'000'000;

  bool started_ = false;
  std::int64_t window_began_ns_ = 0;
  std::int64_t least_before_ = INT64_MAX;  // of kernel - adapter, in the half second before
  std::int64_t least_now_ = INT64_MAX;     // in the present one
};

}  // namespace ravencal::quadrature_reader
