// SPDX-License-Identifier: Apache-2.0
#include "learn/kernels.hpp"

#include "core/require.hpp"

namespace ravencal::learn {

extern const Kernels<float> kBaselineFloatKernels;
extern const Kernels<double> kBaselineDoubleKernels;
#ifdef RAVENCAL_X86_64_KERNELS
extern const Kernels<float> kAvx2FloatKernels;
extern const Kernels<float> kAvx512FloatKernels;
#endif

const Kernels<float>& float_kernels(Isa isa) {
  core::require(is_supported(isa), "this processor lacks the instructions that were asked for");
#ifdef RAVENCAL_X86_64_KERNELS
  if (isa == Isa::kAvx512) return kAvx512FloatKernels;
  if (isa == Isa::kAvx2) return kAvx2FloatKernels;
#endif
  return kBaselineFloatKernels;
}

const Kernels<double>& double_kernels() { return kBaselineDoubleKernels; }

}  // namespace ravencal::learn
