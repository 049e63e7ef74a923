// SPDX-License-Identifier: Apache-2.0
#include "methods/recurrent_kernels.inc"

namespace ravencal::methods {

extern const RecurrentKernels<float> kBaselineRecurrentKernels;
const RecurrentKernels<float> kBaselineRecurrentKernels = kKernels<float>;
extern const RecurrentKernels<double> kDoubleRecurrentKernels;
const RecurrentKernels<double> kDoubleRecurrentKernels = kKernels<double>;

}  // namespace ravencal::methods
