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

/// inputs [inputs of the first layer], scaled as the network was trained -> outputs [outputs of the
/// last]. Finite inputs give finite hidden values behind sigmoid and tanh; a NaN input gives NaN
/// outputs. kInt8 clamps each input to its layer's input limit. `scratch` as scratch_bytes says.
using Forward = void (*)(const PackedView& network, const float* inputs, float* outputs,
                         std::byte* scratch) noexcept;

/// The forward pass of a supported instruction set; fetch it once, outside the loop.
Forward forward_for(Isa isa) noexcept;

}  // namespace ravencal::kernels
