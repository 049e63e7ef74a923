// SPDX-License-Identifier: Apache-2.0
#include "methods/recurrent_kernels.inc"

namespace ravencal::methods {

extern const RecurrentKernels<float> kAvx512RecurrentKernels;
const RecurrentKernels<float> kAvx512RecurrentKernels = kKernels<float>;

}  // namespace ravencal::methods
