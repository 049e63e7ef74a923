// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace ravencal::rt {

/// The plugin's own floating-point mode during its lifetime, whatever the caller's is; then that
/// comes back, with its flags. Rounds to the nearest. Traps nothing: a host that lets exceptions
/// trap (feenableexcept) would otherwise be ended by a value that is not finite (SIGFPE). Reads and
/// writes denormal numbers as zero: as inputs or weights they make a float network 44 to 80 times
/// slower on x86, and nothing else in the data can break the time budget. Costs about 5 ns. The
/// mode belongs to the thread, and the host may call from another thread each time, so it is set in
/// every call. Compilers do not know that arithmetic depends on the mode; the barriers keep what is
/// read from memory inside on this side, and what is read after it on the other.
class OwnFloatMode {
 public:
#if defined(__x86_64__)
  OwnFloatMode() noexcept : saved_(_mm_getcsr()) {
    _mm_setcsr(kMode);
    asm volatile("" ::: "memory");
  }
  ~OwnFloatMode() {
    asm volatile("" ::: "memory");
    _mm_setcsr(saved_);
    asm volatile("" ::: "memory");
  }
#elif defined(__aarch64__)
  OwnFloatMode() noexcept {
    asm volatile("mrs %0, fpcr" : "=r"(saved_));
    asm volatile("mrs %0, fpsr" : "=r"(flags_));
    asm volatile("msr fpcr, %0" ::"r"(kMode) : "memory");
  }
  ~OwnFloatMode() {
    asm volatile("msr fpcr, %0" ::"r"(saved_) : "memory");
    asm volatile("msr fpsr, %0" ::"r"(flags_) : "memory");
  }
#else
  OwnFloatMode() noexcept = default;
#endif
  OwnFloatMode(const OwnFloatMode&) = delete;
  OwnFloatMode& operator=(const OwnFloatMode&) = delete;

 private:
#if defined(__x86_64__)
  /// MXCSR: FTZ (bit 15), all six exceptions masked (bits 12 to 7), DAZ (bit 6).
  static constexpr std::uint32_t kMode = 0x9FC0;
  std::uint32_t saved_;
#elif defined(__aarch64__)
  static constexpr std::uint64_t kMode = std::uint64_t{1} << 24U;  ///< FPCR: FZ, no trap
  std::uint64_t saved_ = 0;
  std::uint64_t flags_ = 0;  ///< FPSR
#endif
};

}  // namespace ravencal::rt
