// SPDX-License-Identifier: Apache-2.0
//
// Sums of products of 8-bit weights and 16-bit inputs, exact in 32 bits (pack.cpp keeps the sums in
// range), so every instruction set gives the same integers. The weights are what memory delivers;
// giving the inputs 16 bits costs arithmetic that would otherwise wait, and leaves the weights as
// the only thing that is rounded. For forward_unit.cpp only.
#pragma once

#include "kernels/vector.hpp"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace ravencal::kernels {
namespace {

/// A layer's quantised inputs, padded with zeros to a multiple of 4: in bytes or whole, as
/// Int8Dot::kTakesBytes says.
struct QuantisedInputs {
  std::int16_t* value;
  std::uint8_t* high;  ///< upper byte + 128
  std::uint8_t* low;   ///< lower byte
  float poison;        ///< NaN if an input was NaN, else 0
};

// Each Int8Dot sums, for kWidth outputs: add() takes 4 inputs' weights of each, sum() ends.
// `Four` are 4 inputs, spread over a vector.

#if defined(__AVX512VNNI__) || defined(__AVXVNNI__)

/// vpdpbusd multiplies unsigned by signed bytes: value = 256 (high - 128) + low.
struct Int8Dot {
  static constexpr bool kTakesBytes = true;
  struct Four {
    Words high;
    Words low;
  };
  Ints high{};
  Ints low{};

  RAVENCAL_INLINE static Four spread(const QuantisedInputs& x, std::size_t first) noexcept {
    std::uint32_t high = 0;
    std::uint32_t low = 0;
    std::memcpy(&high, x.high + first, 4);
    std::memcpy(&low, x.low + first, 4);
    return {Words{} + high, Words{} + low};
  }
  RAVENCAL_INLINE void add(const std::int8_t* weights, const Four& four) noexcept {
    const Ints w = load<Ints>(weights);
    high = products(high, four.high, w);
    low = products(low, four.low, w);
  }
  [[nodiscard]] RAVENCAL_INLINE Ints sum(const std::int32_t* row_sums) const noexcept {
    const Ints centred = high - load<Ints>(row_sums) * 128;
    return same_bits<Ints>((same_bits<Words>(centred) << 8U) + same_bits<Words>(low));
  }

 private:
  RAVENCAL_INLINE static Ints products(const Ints& sum, const Words& x, const Ints& w) noexcept {
#if defined(__AVX512VNNI__)
    return (Ints)_mm512_dpbusd_epi32((__m512i)sum, (__m512i)x, (__m512i)w);
#else
    return (Ints)_mm256_dpbusd_avx_epi32((__m256i)sum, (__m256i)x, (__m256i)w);
#endif
  }
};

#elif defined(__x86_64__)

/// vpmaddwd: two products of 16 bits per 32-bit lane, so an output takes two lanes.
struct Int8Dot {
  static constexpr bool kTakesBytes = false;
  using Four = Ints;
  Ints first{};  ///< the lower half of the outputs, two lanes each
  Ints second{};

  RAVENCAL_INLINE static Four spread(const QuantisedInputs& x, std::size_t at) noexcept {
    long long four = 0;
    std::memcpy(&four, x.value + at, sizeof(four));
#if defined(__AVX512BW__)
    return (Ints)_mm512_set1_epi64(four);
#elif defined(__AVX2__)
    return (Ints)_mm256_set1_epi64x(four);
#else
    return (Ints)_mm_set1_epi64x(four);
#endif
  }
  RAVENCAL_INLINE void add(const std::int8_t* weights, const Four& four) noexcept {
#if defined(__AVX512BW__)
    const __m512i lower = _mm512_cvtepi8_epi16(load<__m256i>(weights));
    const __m512i upper = _mm512_cvtepi8_epi16(load<__m256i>(weights + 32));
    first += (Ints)_mm512_madd_epi16(lower, (__m512i)four);
    second += (Ints)_mm512_madd_epi16(upper, (__m512i)four);
#elif defined(__AVX2__)
    const __m256i lower = _mm256_cvtepi8_epi16(load<__m128i>(weights));
    const __m256i upper = _mm256_cvtepi8_epi16(load<__m128i>(weights + 16));
    first += (Ints)_mm256_madd_epi16(lower, (__m256i)four);
    second += (Ints)_mm256_madd_epi16(upper, (__m256i)four);
#else
    const __m128i w = load<__m128i>(weights);
    const __m128i lower = _mm_srai_epi16(_mm_unpacklo_epi8(w, w), 8);
    const __m128i upper = _mm_srai_epi16(_mm_unpackhi_epi8(w, w), 8);
    first += (Ints)_mm_madd_epi16(lower, (__m128i)four);
    second += (Ints)_mm_madd_epi16(upper, (__m128i)four);
#endif
  }
  [[nodiscard]] RAVENCAL_INLINE Ints sum(const std::int32_t* /*row_sums*/) const noexcept {
    alignas(kVectorBytes) std::int32_t pairs[2 * kWidth];
    store(pairs, first);
    store(pairs + kWidth, second);
    Ints total{};
    for (std::size_t i = 0; i < kWidth; ++i) total[i] = pairs[2 * i] + pairs[2 * i + 1];
    return total;
  }
};

#else

struct Int8Dot {
  static constexpr bool kTakesBytes = false;
  using Four = const std::int16_t*;
  Ints total{};

  RAVENCAL_INLINE static Four spread(const QuantisedInputs& x, std::size_t at) noexcept {
    return x.value + at;
  }
  RAVENCAL_INLINE void add(const std::int8_t* weights, Four four) noexcept {
    for (std::size_t i = 0; i < kWidth; ++i) {
      for (std::size_t j = 0; j < 4; ++j) total[i] += weights[4 * i + j] * four[j];
    }
  }
  [[nodiscard]] RAVENCAL_INLINE Ints sum(const std::int32_t* /*row_sums*/) const noexcept {
    return total;
  }
};

#endif

}  // namespace
}  // namespace ravencal::kernels
