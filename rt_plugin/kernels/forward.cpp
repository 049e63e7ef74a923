// SPDX-License-Identifier: Apache-2.0
#include "kernels/forward.hpp"

#include "kernels/gru_memory.hpp"

#if defined(__x86_64__)
#include <cpuid.h>
#endif

namespace ravencal::kernels {

// One definition per instruction set: forward_unit.cpp.
void forward_portable(const PackedView&, const float*, float*, std::byte*) noexcept;
void forward_avx2(const PackedView&, const float*, float*, std::byte*) noexcept;
void forward_avx2_vnni(const PackedView&, const float*, float*, std::byte*) noexcept;
void forward_avx512(const PackedView&, const float*, float*, std::byte*) noexcept;
void forward_avx512_vnni(const PackedView&, const float*, float*, std::byte*) noexcept;

namespace {

#if defined(__x86_64__)

/// CPUID leaves 1 and 7 and XCR0 (Intel SDM volume 2A, CPUID; volume 1, 13.3). Read here rather
/// than with __builtin_cpu_supports because clang 14 does not know "avxvnni".
struct Processor {
  unsigned leaf1_c = 0;
  unsigned leaf7_b = 0;
  unsigned leaf7_c = 0;
  unsigned leaf7_1_a = 0;
  unsigned enabled_state = 0;

  Processor() noexcept {
    unsigned a = 0;
    unsigned b = 0;
    unsigned c = 0;
    unsigned d = 0;
    if (__get_cpuid(1, &a, &b, &leaf1_c, &d) == 0) return;
    if (__get_cpuid_count(7, 0, &a, &leaf7_b, &leaf7_c, &d) != 0 && a >= 1) {
      __get_cpuid_count(7, 1, &leaf7_1_a, &b, &c, &d);
    }
    constexpr unsigned kOsSavesStates = 1U << 27U;
    if ((leaf1_c & kOsSavesStates) != 0) {
      asm volatile("xgetbv" : "=a"(enabled_state), "=d"(d) : "c"(0));
    }
  }

  [[nodiscard]] bool avx2() const noexcept {
    constexpr unsigned kFma = 1U << 12U;
    constexpr unsigned kAvx2 = 1U << 5U;
    constexpr unsigned kYmmState = 0x6;
    return (leaf1_c & kFma) != 0 && (leaf7_b & kAvx2) != 0 &&
           (enabled_state & kYmmState) == kYmmState;
  }
  [[nodiscard]] bool avx2_vnni() const noexcept {
    constexpr unsigned kAvxVnni = 1U << 4U;
    return avx2() && (leaf7_1_a & kAvxVnni) != 0;
  }
  [[nodiscard]] bool avx512() const noexcept {
    constexpr unsigned kFoundationDqBwVl = (1U << 16U) | (1U << 17U) | (1U << 30U) | (1U << 31U);
    constexpr unsigned kZmmState = 0xE6;
    return avx2() && (leaf7_b & kFoundationDqBwVl) == kFoundationDqBwVl &&
           (enabled_state & kZmmState) == kZmmState;
  }
  [[nodiscard]] bool avx512_vnni() const noexcept {
    constexpr unsigned kVnni = 1U << 11U;
    return avx512() && (leaf7_c & kVnni) != 0;
  }
};

#endif

}  // namespace

const char* name_of(Isa isa) noexcept {
  switch (isa) {
    case Isa::kPortable:
      return "portable";
    case Isa::kAvx2:
      return "avx2";
    case Isa::kAvx2Vnni:
      return "avx2-vnni";
    case Isa::kAvx512:
      return "avx512";
    case Isa::kAvx512Vnni:
      return "avx512-vnni";
  }
  return "unknown";
}

bool is_supported(Isa isa) noexcept {
#if defined(__x86_64__)
  const Processor processor;
  switch (isa) {
    case Isa::kPortable:
      return true;
    case Isa::kAvx2:
      return processor.avx2();
    case Isa::kAvx2Vnni:
      return processor.avx2_vnni();
    case Isa::kAvx512:
      return processor.avx512();
    case Isa::kAvx512Vnni:
      return processor.avx512_vnni();
  }
  return false;
#else
  return isa == Isa::kPortable;
#endif
}

Isa best_isa(Isa limit) noexcept {
  for (auto level = static_cast<std::uint8_t>(limit); level > 0; --level) {
    if (is_supported(static_cast<Isa>(level))) return static_cast<Isa>(level);
  }
  return Isa::kPortable;
}

std::size_t memory_bytes(const PackedView& network, std::uint32_t ticks_per_row) noexcept {
  const PackedLayer gru = network.recurrence();
  if (gru.window == 0) return 0;
  const std::size_t phases = std::size_t{gru.stride_rows} * ticks_per_row;
  const std::size_t units = padded(gru.inputs, kLineLanes);
  const std::size_t states = gru.window - std::size_t{1};
  return sizeof(GruMemory) + states * (gru.outputs + phases * units) * sizeof(float);
}

void clear_memory(const PackedView& network, std::uint32_t ticks_per_row,
                  std::byte* scratch) noexcept {
  const std::size_t bytes = memory_bytes(network, ticks_per_row);
  if (bytes == 0) return;
  std::byte* const memory = scratch + scratch_bytes(network.header().widest);
  __builtin_memset(memory, 0, bytes);
  reinterpret_cast<GruMemory*>(memory)->phases = network.recurrence().stride_rows * ticks_per_row;
}

Forward forward_for(Isa isa) noexcept {
#if defined(__x86_64__)
  switch (isa) {
    case Isa::kPortable:
      return forward_portable;
    case Isa::kAvx2:
      return forward_avx2;
    case Isa::kAvx2Vnni:
      return forward_avx2_vnni;
    case Isa::kAvx512:
      return forward_avx512;
    case Isa::kAvx512Vnni:
      return forward_avx512_vnni;
  }
#endif
  (void)isa;
  return forward_portable;
}

}  // namespace ravencal::kernels
