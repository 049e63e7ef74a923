// SPDX-License-Identifier: Apache-2.0
//
// How the plugin measures its own step: by the processor's time-stamp counter, read in user space.
// clock_gettime would not do: where the kernel's clock source is not that counter (hpet, acpi_pm,
// some virtual machines), its vDSO falls back to a system call.
#pragma once

#include <cstdint>

#if defined(__x86_64__)
#include <x86intrin.h>
#endif

namespace ravencal::rt {

class Stopwatch {
 public:
  /// [init] Compares the counter with CLOCK_MONOTONIC, for 2 ms. The counter's rate is constant on
  /// every x86-64 since 2008 (constant_tsc); before that, figures follow the processor's frequency.
  Stopwatch() noexcept;

  /// [rt] Counter now; meaningless but for since_ns.
  static std::uint64_t now() noexcept {
#if defined(__x86_64__)
    return __rdtsc();
#elif defined(__aarch64__)
    std::uint64_t count = 0;
    asm volatile("mrs %0, cntvct_el0" : "=r"(count));
    return count;
#else
    return 0;
#endif
  }

  /// [rt] Nanoseconds since `start`. 0 if the counter ran back, as between processors whose
  /// counters are not in step.
  [[nodiscard]] std::uint32_t since_ns(std::uint64_t start) const noexcept {
    // Whole numbers, so that the caller's floating-point flags stay as they are.
    const std::uint64_t ticks = now() - start;
    const bool ran_back = ticks > UINT64_MAX / 2;
    const std::uint64_t ns =
        ran_back ? 0 : (ticks < kMostTicks ? ticks : kMostTicks) * scale_ >> kScaleBits;
    return ns < UINT32_MAX ? static_cast<std::uint32_t>(ns) : UINT32_MAX;
  }

 private:
  static constexpr unsigned kScaleBits = 22;
  static constexpr std::uint64_t kMostTicks = std::uint64_t{1} << 34U;  ///< more than 4 s

  std::uint64_t scale_ = 0;  ///< nanoseconds per tick * 2^kScaleBits
};

}  // namespace ravencal::rt
