// SPDX-License-Identifier: Apache-2.0
//
// Random numbers that are the same with every compiler and library: the standard fixes the Mersenne
// twister's numbers but not those of its distributions.
#pragma once

#include <cstdint>
#include <random>
#include <span>
#include <utility>

namespace ravencal::learn {

class Random {
 public:
  explicit Random(std::uint64_t seed) : generator_(seed) {}

  /// Uniform in [0, 1), 53 bits.
  double unit() { return static_cast<double>(generator_() >> 11U) * 0x1.0p-53; }

  /// Uniform in [0, count); count >= 1. Bias below count / 2^53.
  std::uint64_t below(std::uint64_t count) {
    return static_cast<std::uint64_t>(unit() * static_cast<double>(count));
  }

  /// Fisher-Yates.
  template <typename T>
  void shuffle(std::span<T> values) {
    for (std::size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[below(i)]);
  }

 private:
  std::mt19937_64 generator_;
};

/// A number in [0, 1) that depends on `key` alone: 24 bits of SplitMix64 (Steele, Lea and Flood,
/// OOPSLA 2014). For draws that must not depend on the order of threads.
inline float hashed_unit(std::uint64_t key) {
  key += 0x9e3779b97f4a7c15ULL;
  key = (key ^ (key >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  key = (key ^ (key >> 27U)) * 0x94d049bb133111ebULL;
  return static_cast<float>((key ^ (key >> 31U)) >> 40U) * 0x1.0p-24F;
}

}  // namespace ravencal::learn
