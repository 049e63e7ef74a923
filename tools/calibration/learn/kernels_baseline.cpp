// SPDX-License-Identifier: Apache-2.0
#include "learn/kernels.inc"

namespace ravencal::learn {

extern const Kernels<float> kBaselineFloatKernels;
extern const Kernels<double> kBaselineDoubleKernels;
const Kernels<float> kBaselineFloatKernels = kKernels<float>;
const Kernels<double> kBaselineDoubleKernels = kKernels<double>;

}  // namespace ravencal::learn
