// SPDX-License-Identifier: Apache-2.0
//
// Draws of the sealed generator: the same numbers on every machine, and streams that do not
// disturb each other, so that a case and its twin without the effect share all their noise.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string_view>

namespace ravencal::prove {

/// SplitMix64 (Steele, Lea, Flood 2014).
class Random {
 public:
  /// Streams of one seed are told apart by name.
  Random(std::uint64_t seed, std::string_view stream) : state_(seed * 0x9e3779b97f4a7c15ULL) {
    for (const char c : stream) state_ = mixed(state_ ^ static_cast<unsigned char>(c));
  }

  std::uint64_t bits() { return mixed(state_ += 0x9e3779b97f4a7c15ULL); }
  /// [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11U) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double log_uniform(double low, double high) {
    return low * std::exp(uniform() * std::log(high / low));
  }
  /// [0, count).
  std::size_t below(std::size_t count) {
    return static_cast<std::size_t>(uniform() * static_cast<double>(count));
  }
  double sign() { return uniform() < 0.5 ? -1.0 : 1.0; }
  /// Standard normal (Box and Muller); always two draws.
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  static std::uint64_t mixed(std::uint64_t z) {
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31U);
  }
  std::uint64_t state_;
};

/// Noise that remembers: first order, `deviation` in the long run (Ornstein and Uhlenbeck).
class Coloured {
 public:
  Coloured() = default;
  Coloured(double deviation, double time_s, double dt_s)
      : keep_(std::exp(-dt_s / time_s)), push_(deviation * std::sqrt(1.0 - keep_ * keep_)) {}
  double step(Random& random) { return state_ = keep_ * state_ + push_ * random.normal(); }

 private:
  double keep_ = 0.0;
  double push_ = 0.0;
  double state_ = 0.0;
};

}  // namespace ravencal::prove
