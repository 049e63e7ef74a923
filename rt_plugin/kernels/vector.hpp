// SPDX-License-Identifier: Apache-2.0
//
// The compiler's own vectors, for weights in bfloat16 and int8: Eigen 3.4 converts neither in
// vectors. For forward_unit.cpp only: everything is in an unnamed namespace (lanes.hpp).
#pragma once

#include <cstdint>
#include <cstring>

#include "kernels/lanes.hpp"

namespace ravencal::kernels {
namespace {

// GCC's and clang's vector extension: plain operators, one instruction each.
using Floats = float __attribute__((vector_size(kVectorBytes)));
using Ints = std::int32_t __attribute__((vector_size(kVectorBytes)));
using Words = std::uint32_t __attribute__((vector_size(kVectorBytes)));
using Shorts = std::int16_t __attribute__((vector_size(kVectorBytes / 2)));
using Bytes = std::uint8_t __attribute__((vector_size(kVectorBytes / 4)));

/// `at` is aligned to kVectorBytes.
template <typename Vector, typename Element>
RAVENCAL_INLINE Vector load(const Element* at) noexcept {
  Vector value;
  std::memcpy(&value, __builtin_assume_aligned(at, sizeof(Vector)), sizeof(Vector));
  return value;
}

template <typename Vector, typename Element>
RAVENCAL_INLINE void store(Element* at, const Vector& value) noexcept {
  std::memcpy(__builtin_assume_aligned(at, sizeof(Vector)), &value, sizeof(Vector));
}

/// Minus zero, which changes no value; plus zero would change -0, and so cost an instruction.
RAVENCAL_INLINE Floats broadcast(float value) noexcept { return value - Floats{}; }

template <typename Target, typename Source>
RAVENCAL_INLINE Target same_bits(const Source& source) noexcept {
  static_assert(sizeof(Target) == sizeof(Source));
  return (Target)source;  // the vector extension's reinterpretation has no other spelling
}

/// Weight `j` of the kGroup that lie in a 32-bit lane (packed_network.hpp), in units of its row. A
/// bfloat16 is the upper half of an f32.
template <std::size_t kGroup>
RAVENCAL_INLINE Floats weight_in(const Words& lane, std::size_t j) noexcept {
  if constexpr (kGroup == 2) {
    return same_bits<Floats>(j == 0 ? lane << 16U : lane & 0xFFFF0000U);
  } else {
    const Words upper = lane << static_cast<std::uint32_t>(24 - 8 * j);
    return __builtin_convertvector(same_bits<Ints>(upper) >> 24, Floats);
  }
}

}  // namespace
}  // namespace ravencal::kernels
