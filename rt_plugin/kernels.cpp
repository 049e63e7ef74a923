// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/kernels.hpp"

#include "ravencal/plugin.h"

namespace ravencal::rt {
namespace {

std::span<const NetworkKernel> kernels_of(std::uint32_t isa) noexcept {
  switch (isa) {
    case RAVENCAL_ISA_AVX512:
      return avx512_kernels();
    case RAVENCAL_ISA_AVX2:
      return avx2_kernels();
    default:
      return baseline_kernels();
  }
}

bool fits(std::span<const std::uint32_t> sizes, const model::NetworkShape& shape) noexcept {
  if (sizes.size() != shape.layers + std::size_t{1}) return false;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    if (sizes[i] > shape.sizes[i]) return false;
  }
  return true;
}

}  // namespace

#if !defined(__x86_64__)
std::span<const NetworkKernel> avx2_kernels() noexcept { return {}; }
std::span<const NetworkKernel> avx512_kernels() noexcept { return {}; }
#endif

std::uint32_t best_isa(std::uint32_t max_isa) noexcept {
  const std::uint32_t limit = max_isa == RAVENCAL_ISA_BEST ? RAVENCAL_ISA_AVX512 : max_isa;
#if defined(__x86_64__)
  __builtin_cpu_init();
  const bool avx2 = __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
  const bool avx512 =
      avx2 && __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
      __builtin_cpu_supports("avx512bw") != 0 && __builtin_cpu_supports("avx512vl") != 0;
  if (avx512 && limit >= RAVENCAL_ISA_AVX512) return RAVENCAL_ISA_AVX512;
  if (avx2 && limit >= RAVENCAL_ISA_AVX2) return RAVENCAL_ISA_AVX2;
#endif
  (void)limit;
  return RAVENCAL_ISA_BASELINE;
}

KernelChoice choose_kernel(std::span<const std::uint32_t> sizes, std::uint32_t isa) noexcept {
  KernelChoice choice;
  for (const NetworkKernel& kernel : kernels_of(isa)) {
    if (!fits(sizes, kernel.shape)) continue;
    if (choice.kernel == nullptr ||
        kernel.shape.arena_floats() < choice.kernel->shape.arena_floats()) {
      choice = {&kernel, isa};
    }
  }
  return choice;
}

}  // namespace ravencal::rt
