// SPDX-License-Identifier: Apache-2.0
//
// Runs a packed network, one sample at a time, in real time: no allocation, lock, system call or
// libm call; the number of instructions depends on the network and the instruction set, never on
// the data. The caller flushes denormals (FTZ and DAZ): with them the time does not depend on the
// data either.
#pragma once

#include <cstddef>
#include <cstdint>

#include "model/packed_network.hpp"

namespace ravencal::kernels {

using namespace model::packed;

/// Instruction sets, each a superset of those that it can replace.
enum class Isa : std::uint8_t {
  kPortable = 0,    ///< the compiler's baseline: SSE2 on x86-64, NEON on AArch64
  kAvx2 = 1,        ///< AVX2 and FMA
  kAvx2Vnni = 2,    ///< and AVX-VNNI
  kAvx512 = 3,      ///< AVX-512 F, BW, DQ, VL
  kAvx512Vnni = 4,  ///< and AVX-512 VNNI
};
inline constexpr std::size_t kIsaCount = 5;

/// "portable", "avx2", "avx2-vnni", "avx512" or "avx512-vnni".
const char* name_of(Isa isa) noexcept;

/// Whether the build has it and the processor and the operating system support it.
bool is_supported(Isa isa) noexcept;

/// The best supported one that is not above `limit`; the same on every call.
Isa best_isa(Isa limit = Isa::kAvx512Vnni) noexcept;

/// Bytes of 64-byte aligned memory that a forward pass needs; its content need not be kept.
constexpr std::size_t scratch_bytes(std::uint32_t widest) noexcept {
  return std::size_t{widest} * (2 * sizeof(float) + 2 * sizeof(std::uint16_t));
}

/// What a network with a GRU keeps between two passes, behind the scratch memory: bytes that are
/// kept, 64-byte aligned. 0 for other networks. One pass a tick advances, in constant time, all the
/// windows that the tick's sample belongs to: the sample of a tick is the first of one window, the
/// second of the window that began a stride earlier, and so on, so each pass multiplies the
/// recurrent weights, read once, with the window - 1 states that end a stride ago; and the input
/// weights with the inputs once for all. `ticks_per_row`: calls of the pass per row of training.
std::size_t memory_bytes(const PackedView& network, std::uint32_t ticks_per_row) noexcept;

/// Makes that memory ready, its states zero; once, before the first pass. Outputs are those of the
/// whole window after (window - 1) * stride_rows * ticks_per_row more passes; whatever was before
/// has no influence then.
void clear_memory(const PackedView& network, std::uint32_t ticks_per_row,
                  std::byte* scratch) noexcept;

/// inputs [inputs of the first layer], scaled as the network was trained -> outputs [outputs of the
/// last]. Finite inputs give finite hidden values behind sigmoid and tanh; a NaN input gives NaN
/// outputs; a GRU remembers inputs of zero in place of a sample with a NaN. kInt8 clamps each input
/// to its layer's input limit. `scratch` as scratch_bytes and memory_bytes say.
using Forward = void (*)(const PackedView& network, const float* inputs, float* outputs,
                         std::byte* scratch) noexcept;

/// The forward pass of a supported instruction set; fetch it once, outside the loop.
Forward forward_for(Isa isa) noexcept;

}  // namespace ravencal::kernels
