// SPDX-License-Identifier: Apache-2.0
#include "learn/kernels.inc"

namespace ravencal::learn {

extern const Kernels<float> kFloatKernels_avx2;
const Kernels<float> kFloatKernels_avx2 = kKernels<float>;

}  // namespace ravencal::learn
