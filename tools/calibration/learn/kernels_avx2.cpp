// SPDX-License-Identifier: Apache-2.0
#include "learn/kernels.inc"

namespace ravencal::learn {

extern const Kernels<float> kAvx2FloatKernels;
const Kernels<float> kAvx2FloatKernels = kKernels<float>;

}  // namespace ravencal::learn
