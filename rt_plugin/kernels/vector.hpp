// SPDX-License-Identifier: Apache-2.0
//
// Vectors of the widest kind that the including unit's instruction set has, and the functions that
// a network applies to them. For forward_unit.cpp only: everything is in an unnamed namespace, so
// that the linker never merges the code of two instruction sets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "model/kinds.hpp"

namespace ravencal::kernels {
namespace {

#if defined(__AVX512F__)
constexpr std::size_t kVectorBytes = 64;
#elif defined(__AVX2__)
constexpr std::size_t kVectorBytes = 32;
#else
constexpr std::size_t kVectorBytes = 16;
#endif
constexpr std::size_t kWidth = kVectorBytes / 4;  ///< 32-bit lanes

// GCC's and clang's vector extension: plain operators, one instruction each.
using Floats = float __attribute__((vector_size(kVectorBytes)));
using Ints = std::int32_t __attribute__((vector_size(kVectorBytes)));
using Words = std::uint32_t __attribute__((vector_size(kVectorBytes)));
using Shorts = std::int16_t __attribute__((vector_size(kVectorBytes / 2)));
using Bytes = std::uint8_t __attribute__((vector_size(kVectorBytes / 4)));

#define RAVENCAL_INLINE [[gnu::always_inline]] inline

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

template <typename To, typename From>
RAVENCAL_INLINE To same_bits(const From& from) noexcept {
  static_assert(sizeof(To) == sizeof(From));
  return (To)from;  // the vector extension's reinterpretation has no other spelling
}

/// A lane of `a` where the mask's lane is -1, of `b` where it is 0.
RAVENCAL_INLINE Floats select(const Ints& mask, const Floats& a, const Floats& b) noexcept {
  return same_bits<Floats>((mask & same_bits<Ints>(a)) | (~mask & same_bits<Ints>(b)));
}

/// Comparisons with NaN are false, so a NaN stays.
RAVENCAL_INLINE Floats clamp(const Floats& x, float low, float high) noexcept {
  const Floats not_low = select(x < broadcast(low), broadcast(low), x);
  return select(not_low > broadcast(high), broadcast(high), not_low);
}

/// Adding it moves the nearest integer of |x| < 2^22 into the lowest bits.
constexpr float kRounder = 12582912.0F;  // 1.5 * 2^23

/// exp(x) for |x| <= 87 (so that result and inverse are normal numbers), else exp of the nearer
/// limit; NaN stays. Relative error below 1.2e-7: x = n ln 2 + r, |r| <= ln 2 / 2, and the
/// polynomial of Cephes' expf (S. Moshier, netlib.org/cephes) for exp(r).
RAVENCAL_INLINE Floats exponential(const Floats& unlimited) noexcept {
  const Floats x = clamp(unlimited, -87.0F, 87.0F);
  const Floats shifted = x * broadcast(1.44269504F) + broadcast(kRounder);
  const Floats n = shifted - broadcast(kRounder);
  const Floats r = (x - n * broadcast(0.693359375F)) - n * broadcast(-2.12194440e-4F);
  Floats p = broadcast(1.9875691500e-4F);
  p = p * r + broadcast(1.3981999507e-3F);
  p = p * r + broadcast(8.3334519073e-3F);
  p = p * r + broadcast(4.1665795894e-2F);
  p = p * r + broadcast(1.6666665459e-1F);
  p = p * r + broadcast(5.0000001201e-1F);
  p = p * (r * r) + (r + broadcast(1.0F));
  const Words power = (same_bits<Words>(shifted) << 23U) + 0x3F800000U;
  return p * same_bits<Floats>(power);
}

/// 1 / (1 + exp(-x)), absolute error below model::kSigmoidError, in [0, 1].
RAVENCAL_INLINE Floats sigmoid(const Floats& x) noexcept {
  return broadcast(1.0F) / (broadcast(1.0F) + exponential(-x));
}

/// Absolute error below model::kTanhError, in [-1, 1].
RAVENCAL_INLINE Floats hyperbolic_tangent(const Floats& x) noexcept {
  const Floats e = exponential(x * broadcast(-2.0F));
  return (broadcast(1.0F) - e) / (broadcast(1.0F) + e);
}

/// NaN stays NaN.
RAVENCAL_INLINE Floats rectified(const Floats& x) noexcept {
  return select(x < broadcast(0.0F), broadcast(0.0F), x);
}

RAVENCAL_INLINE Floats activated(model::Activation activation, const Floats& x) noexcept {
  switch (activation) {
    case model::Activation::kLinear:
      return x;
    case model::Activation::kSigmoid:
      return sigmoid(x);
    case model::Activation::kTanh:
      return hyperbolic_tangent(x);
    case model::Activation::kRelu:
      return rectified(x);
  }
  return x;
}

}  // namespace
}  // namespace ravencal::kernels
