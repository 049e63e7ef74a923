// SPDX-License-Identifier: Apache-2.0
#include "learn/kernels.inc"

namespace ravencal::learn {

extern const Kernels<float> kFloatKernels_baseline;
extern const Kernels<double> kDoubleKernels_baseline;
const Kernels<float> kFloatKernels_baseline = kKernels<float>;
const Kernels<double> kDoubleKernels_baseline = kKernels<double>;

}  // namespace ravencal::learn
