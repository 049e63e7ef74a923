// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/sources/can_clock.hpp"

#include <algorithm>

namespace ravencal::quadrature_reader {
namespace {

// No frame waits longer for the kernel: the adapter's clock was set or began again.
constexpr std::int64_t kLargestDelayNs = 100'000'000;

}  // namespace

std::int64_t CanClock::to_monotonic(std::int64_t adapter_ns, std::int64_t kernel_ns) {
  const std::int64_t difference = kernel_ns - adapter_ns;
  const std::int64_t elapsed_ns = kernel_ns - window_began_ns_;
  if (!started_ || elapsed_ns >= 2 * kHalfWindowNs ||
      difference - std::min(least_before_, least_now_) > kLargestDelayNs) {
    started_ = true;
    least_before_ = INT64_MAX;
    least_now_ = difference;
    window_began_ns_ = kernel_ns;
  } else if (elapsed_ns >= kHalfWindowNs) {
    least_before_ = least_now_;
    least_now_ = difference;
    window_began_ns_ = kernel_ns;
  }
  least_now_ = std::min(least_now_, difference);
  return adapter_ns + std::min(least_before_, least_now_);
}

}  // namespace ravencal::quadrature_reader
