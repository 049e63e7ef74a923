// SPDX-License-Identifier: Apache-2.0
#include "learn/kernels.inc"

namespace ravencal::learn {

extern const Kernels<float> kAvx512FloatKernels;
const Kernels<float> kAvx512FloatKernels = kKernels<float>;

}  // namespace ravencal::learn
