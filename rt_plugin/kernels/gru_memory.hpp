// SPDX-License-Identifier: Apache-2.0
//
// What a GRU keeps between two passes: this header, then the recurrent products of one pass
// [window - 1][3 * padded units], then for every phase (tick modulo stride) the states behind the
// first window - 1 samples of the windows under way, [phases][window - 1][padded units].
#pragma once

#include <cstdint>

namespace ravencal::kernels {

struct alignas(64) GruMemory {
  std::uint32_t phases;  ///< ticks between two samples of a window
  std::uint32_t phase;   ///< of the next pass
};

}  // namespace ravencal::kernels
