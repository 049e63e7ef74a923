// SPDX-License-Identifier: Apache-2.0
#include "methods/recurrent_kernels.inc"

namespace ravencal::methods {

extern const RecurrentKernels<float> kAvx2RecurrentKernels;
const RecurrentKernels<float> kAvx2RecurrentKernels = kKernels<float>;

}  // namespace ravencal::methods
