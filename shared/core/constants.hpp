// SPDX-License-Identifier: Apache-2.0
//
// Factors between units that more than one module converts by.
#pragma once

#include <cstdint>
#include <numbers>

namespace ravencal::core {

inline constexpr double kRadPerDeg = std::numbers::pi / 180.0;
inline constexpr double kDegPerRad = 180.0 / std::numbers::pi;
inline constexpr double kRadPerTurn = 2.0 * std::numbers::pi;
inline constexpr std::int64_t kNsPerS = 1'000'000'000;
inline constexpr std::int64_t kNsPerMs = 1'000'000;
inline constexpr double kSecondsPerNs = 1e-9;
inline constexpr double kNsPerUs = 1e3;

}  // namespace ravencal::core
