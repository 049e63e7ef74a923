// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace ravencal::diagnose {

/// Seed of one stage's generator, from the report's and the stage's name; `index` tells apart what
/// a stage does several times. FNV-1a of the name, mixed as splitmix64 does (Steele, Lea, Flood,
/// OOPSLA 2014): stages share no draws, and a new one changes no other.
constexpr std::uint64_t derived_seed(std::uint64_t seed, std::string_view stage,
                                     std::size_t index = 0) {
  std::uint64_t name = 0xcbf29ce484222325U;
  for (const char c : stage) name = (name ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  std::uint64_t z = seed + name + 0x9e3779b97f4a7c15U * (index + 1);
  z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
  return z ^ (z >> 31U);
}

}  // namespace ravencal::diagnose
