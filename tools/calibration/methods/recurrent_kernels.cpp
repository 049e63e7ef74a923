// SPDX-License-Identifier: Apache-2.0
#include "methods/recurrent_kernels.hpp"

namespace ravencal::methods {

extern const RecurrentKernels<float> kBaselineRecurrentKernels;
extern const RecurrentKernels<double> kDoubleRecurrentKernels;
#ifdef RAVENCAL_X86_64_KERNELS
extern const RecurrentKernels<float> kAvx2RecurrentKernels;
extern const RecurrentKernels<float> kAvx512RecurrentKernels;
#endif

const RecurrentKernels<float>& recurrent_kernels(learn::Isa isa) {
#ifdef RAVENCAL_X86_64_KERNELS
  if (isa == learn::Isa::kAvx512) return kAvx512RecurrentKernels;
  if (isa == learn::Isa::kAvx2) return kAvx2RecurrentKernels;
#endif
  static_cast<void>(isa);
  return kBaselineRecurrentKernels;
}

const RecurrentKernels<double>& recurrent_double_kernels() { return kDoubleRecurrentKernels; }

}  // namespace ravencal::methods
