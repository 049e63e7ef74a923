// SPDX-License-Identifier: Apache-2.0
#include "learn/kernels.hpp"

#include <cassert>

namespace ravencal::learn {

extern const Kernels<float> kFloatKernels_baseline;
extern const Kernels<double> kDoubleKernels_baseline;
#ifdef RAVENCAL_X86_64_KERNELS
extern const Kernels<float> kFloatKernels_avx2;
extern const Kernels<float> kFloatKernels_avx512;
#endif

const Kernels<float>& float_kernels(Isa isa) {
  assert(is_supported(isa));
#ifdef RAVENCAL_X86_64_KERNELS
  if (isa == Isa::kAvx512) return kFloatKernels_avx512;
  if (isa == Isa::kAvx2) return kFloatKernels_avx2;
#endif
  return kFloatKernels_baseline;
}

const Kernels<double>& double_kernels() { return kDoubleKernels_baseline; }

}  // namespace ravencal::learn
