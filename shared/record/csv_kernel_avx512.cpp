// SPDX-License-Identifier: Apache-2.0
//
// Numbers up to 19 digits without a loop over characters: classify 32 bytes at once, squeeze out
// what is no digit, sum the digits pairwise. D. Lemire, "Number parsing at a gigabyte per second",
// 2021, for the rounding (fast_float::compute_float), W. Mula for the pairwise sums.
#include "record/csv_kernel.hpp"

#if defined(__x86_64__)

#include <immintrin.h>

#include <array>
#include <bit>
#include <cmath>

#include "record/csv_number.hpp"

#define RAVENCAL_AVX512 \
  __attribute__((target("avx512f,avx512bw,avx512vl,avx512vbmi2,avx512dq,bmi,bmi2,popcnt,lzcnt")))
#define RAVENCAL_AVX512_INLINE RAVENCAL_AVX512 __attribute__((always_inline)) inline

namespace ravencal::record {
namespace {

constexpr std::size_t kMaxLength = 32;  // of a field on the fast path
constexpr int kMaxDigits = 19;          // 10^19 - 1 fits into 64 bits

// Powers of ten that a double holds exactly.
constexpr std::array<double, 23> kExactPower = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                                1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
constexpr std::uint64_t kExactInteger = std::uint64_t{1} << 53U;

// shuffle(v, kShiftUp + 16 - n) moves the first n bytes of v to its end and fills with zeros.
alignas(64) constexpr std::array<std::int8_t, 32> kShiftUp = {
    0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11, 12, 13, 14, 15,
    -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};

RAVENCAL_AVX512_INLINE std::uint64_t sum_16_digits(__m128i digits) {
  const __m128i by_2 = _mm_maddubs_epi16(digits, _mm_set1_epi16(0x010A));  // 10 a + b
  const __m128i by_4 = _mm_madd_epi16(by_2, _mm_set1_epi32(0x00010064));   // 100 a + b
  const __m128i packed = _mm_packus_epi32(by_4, by_4);
  const __m128i by_8 = _mm_madd_epi16(packed, _mm_set1_epi32(0x00012710));  // 10^4 a + b
  const auto both = static_cast<std::uint64_t>(_mm_cvtsi128_si64(by_8));
  return (both & 0xffffffffU) * 100000000U + (both >> 32U);
}

/// The first `count` bytes of `digits`, values 0..9, as one number.
RAVENCAL_AVX512_INLINE std::uint64_t sum_digits(__m256i digits, int count) {
  const __m128i first = _mm256_castsi256_si128(digits);
  if (count <= 16) {
    const int zeros = 16 - count;
    const __m128i order =
        _mm_sub_epi8(_mm_load_si128(reinterpret_cast<const __m128i*>(kShiftUp.data())),
                     _mm_set1_epi8(static_cast<char>(zeros)));
    return sum_16_digits(_mm_shuffle_epi8(first, order));
  }
  auto rest = static_cast<std::uint32_t>(_mm_cvtsi128_si32(_mm256_extracti128_si256(digits, 1)));
  std::uint64_t sum = sum_16_digits(first);
  for (int i = 16; i < count; ++i, rest >>= 8U) sum = sum * 10 + (rest & 0xffU);
  return sum;
}

/// The exponent that begins with the 'e' at `first`, of the common form e+05; `digits` are the bits
/// of its characters that are digits, `length` counts the 'e'. False for any other form.
RAVENCAL_AVX512_INLINE bool parse_exponent(const char* first, std::uint32_t digits,
                                           std::size_t length, int& exponent) {
  const auto plus = static_cast<int>(first[1] == '+');
  const auto minus = static_cast<int>(first[1] == '-');
  const int value = (first[2] - '0') * 10 + (first[3] - '0');
  exponent = (value ^ -minus) + minus;  // no branch, because signs are unpredictable
  const int common = static_cast<int>((first[0] | 0x20) == 'e') & static_cast<int>(length == 4) &
                     static_cast<int>(digits == 0xcU) & (plus | minus);
  return common != 0;
}

/// digits x 10^exponent, correctly rounded; NaN where that takes the long way.
RAVENCAL_AVX512_INLINE double scale(std::uint64_t digits, int exponent) {
  if (digits <= kExactInteger && exponent <= 0 && exponent >= -22) {
    return static_cast<double>(digits) / kExactPower[static_cast<std::size_t>(-exponent)];
  }
  if (digits <= kExactInteger && exponent > 0 && exponent <= 22) {
    return static_cast<double>(digits) * kExactPower[static_cast<std::size_t>(exponent)];
  }
  const auto rounded =
      fast_float::compute_float<fast_float::binary_format<double>>(exponent, digits);
  if (rounded.power2 < 0) return std::nan("");
  return std::bit_cast<double>(rounded.mantissa |
                               (static_cast<std::uint64_t>(rounded.power2) << 52U));
}

/// The same for 19 digits, whose product with a power of five never fits: two multiplications
/// without a branch between them, since float32 values printed in full lie next to a double half of
/// the time.
RAVENCAL_AVX512_INLINE double scale_long(std::uint64_t digits, int exponent) {
  constexpr int kFirstPower = fast_float::powers::smallest_power_of_five;
  const int zeros = std::countl_zero(digits);
  const std::uint64_t shifted = digits << (zeros & 63);
  const std::uint64_t* const power =
      &fast_float::powers::power_of_five_128[2L * (exponent - kFirstPower)];
  unsigned long long high = 0;
  unsigned long long high_2 = 0;
  const std::uint64_t low_1 = _mulx_u64(shifted, power[0], &high);
  (void)_mulx_u64(shifted, power[1], &high_2);
  const std::uint64_t low = low_1 + high_2;
  high += static_cast<unsigned>(low < low_1);
  const unsigned upper = static_cast<unsigned>(high >> 63U);
  const std::uint64_t twice = high >> (9U + upper);  // 54 bits: the mantissa and the rounding bit
  // Doubtful, as in compute_float: perhaps exactly halfway, or a carry from beyond 128 bits.
  const bool halfway = (low <= 1) & ((twice & 1U) != 0);
  const bool carry = (low == ~std::uint64_t{0}) & ((exponent < -27) | (exponent > 55));
  if ((digits == 0) | halfway | carry) return scale(digits, exponent);
  const int biased = fast_float::detail::power(exponent) + static_cast<int>(upper) - zeros + 1023;
  // A carry out of the mantissa moves on into the exponent, as it must.
  return std::bit_cast<double>((static_cast<std::uint64_t>(biased - 1) << 52U) +
                               ((twice + (twice & 1U)) >> 1U));
}

/// The form d.dddddddddddddddddde+dd, as numpy.savetxt writes all numbers; NaN if it is another.
RAVENCAL_AVX512_INLINE double parse_savetxt(const char* first, std::size_t length) {
  const bool negative = *first == '-';
  if (length != 24U + static_cast<unsigned>(negative)) return std::nan("");
  first += static_cast<std::ptrdiff_t>(negative);
  const __m256i text = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(first));
  const __m256i values = _mm256_sub_epi8(text, _mm256_set1_epi8('0'));
  const std::uint32_t digits = _mm256_cmple_epu8_mask(values, _mm256_set1_epi8(9)) & 0xffffffU;
  const bool minus = first[21] == '-';
  const bool form =
      (digits == 0xcffffdU) & (first[1] == '.') & (first[20] == 'e') & (minus | (first[21] == '+'));
  if (!form) return std::nan("");
  const auto digit = [first](std::size_t i) { return static_cast<std::uint64_t>(first[i] - '0'); };
  const __m128i middle = _mm_sub_epi8(_mm_loadu_si128(reinterpret_cast<const __m128i*>(first + 2)),
                                      _mm_set1_epi8('0'));
  const std::uint64_t sum = digit(0) * 1'000'000'000'000'000'000U + sum_16_digits(middle) * 100U +
                            digit(18) * 10U + digit(19);
  const int magnitude = static_cast<int>(digit(22) * 10U + digit(23));
  const int sign = -static_cast<int>(minus);
  const double value = scale_long(sum, ((magnitude ^ sign) - sign) - 18);
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(value) ^
                               (static_cast<std::uint64_t>(negative) << 63U));
}

/// NaN if the field is not of the common form [-]digits[.digits][e[+-]digits].
RAVENCAL_AVX512_INLINE double parse_common(const char* first, std::size_t length) {
  if (length == 0 || length > kMaxLength) return std::nan("");
  const __m256i text = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(first));
  const __m256i values = _mm256_sub_epi8(text, _mm256_set1_epi8('0'));
  const std::uint32_t all = _bzhi_u32(~0U, static_cast<unsigned>(length));
  std::uint32_t digits = all & _mm256_cmple_epu8_mask(values, _mm256_set1_epi8(9));
  const std::uint32_t point = all & _mm256_cmpeq_epi8_mask(text, _mm256_set1_epi8('.'));
  const bool negative = *first == '-';
  std::uint32_t other = all & ~digits & ~point & ~static_cast<std::uint32_t>(negative);
  int exponent = 0;
  if (other != 0) {
    const unsigned at = static_cast<unsigned>(std::countr_zero(other));
    if (!parse_exponent(first + at, digits >> at, length - at, exponent)) return std::nan("");
    digits = _bzhi_u32(digits, at);
  }
  const int count = std::popcount(digits);
  if (count == 0 || count > kMaxDigits || (point & (point - 1)) != 0) return std::nan("");
  exponent -= std::popcount(digits & ~_blsmsk_u32(point));
  const double value =
      scale(sum_digits(_mm256_maskz_compress_epi8(digits, values), count), exponent);
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(value) ^
                               (static_cast<std::uint64_t>(negative) << 63U));
}

RAVENCAL_AVX512 bool parse(const char* line, const std::uint32_t* ends,
                           std::span<const NumberField> fields, double* row) {
  for (const NumberField& field : fields) {
    const char* const first = field.field == 0 ? line : line + ends[field.field - 1] + 1;
    const char* const last = line + ends[field.field];
    const auto length = static_cast<std::size_t>(last - first);
    double value = length >= 24U ? parse_savetxt(first, length) : std::nan("");
    if (std::isnan(value)) value = parse_common(first, length);
    if (std::isnan(value) && (parse_number(first, last, value) != last || !std::isfinite(value))) {
      return false;
    }
    row[field.target] = value;
  }
  return true;
}

/// Writes base + the positions of the set bits of `mask`; returns their number.
RAVENCAL_AVX512_INLINE std::size_t write_positions(std::uint64_t mask, std::uint32_t base,
                                                   std::uint32_t* out) {
  alignas(64) static constexpr auto kPositions = [] {
    std::array<std::uint8_t, 64> positions{};
    for (std::size_t i = 0; i < positions.size(); ++i) positions[i] = static_cast<std::uint8_t>(i);
    return positions;
  }();
  const __m512i set = _mm512_maskz_compress_epi8(mask, _mm512_load_si512(kPositions.data()));
  const auto count = static_cast<std::size_t>(std::popcount(mask));
  const __m512i offset = _mm512_set1_epi32(static_cast<int>(base));
  alignas(64) std::array<std::uint8_t, 64> bytes{};
  if (count > 16) _mm512_store_si512(bytes.data(), set);
  _mm512_storeu_si512(out,
                      _mm512_add_epi32(offset, _mm512_cvtepu8_epi32(_mm512_castsi512_si128(set))));
  for (std::size_t i = 16; i < count; ++i) out[i] = base + bytes[i];
  return count;
}

RAVENCAL_AVX512 std::size_t split(const char* line, std::size_t limit, std::uint32_t* ends) {
  std::size_t count = 0;
  for (std::uint32_t at = 0; count <= limit; at += 64) {
    const __m512i text = _mm512_loadu_si512(line + at);
    const std::uint64_t line_end = _mm512_cmpeq_epi8_mask(text, _mm512_set1_epi8('\n'));
    const std::uint64_t here = _blsmsk_u64(line_end);  // up to the first line end, or all
    const std::uint64_t comma = _mm512_cmpeq_epi8_mask(text, _mm512_set1_epi8(','));
    count += write_positions((comma | line_end) & here, at, ends + count);
    if (line_end != 0) break;
  }
  return count;
}

constexpr CsvKernel kAvx512 = {split, parse};

}  // namespace

const CsvKernel* avx512_csv_kernel() {
  static const bool supported =
      __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vbmi2") && __builtin_cpu_supports("bmi2");
  return supported ? &kAvx512 : nullptr;
}

}  // namespace ravencal::record

#else

namespace ravencal::record {
const CsvKernel* avx512_csv_kernel() { return nullptr; }
}  // namespace ravencal::record

#endif
