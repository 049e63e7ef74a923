// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace ravencal::learn {

/// What a network may be asked for; more is a slip of the pen and would only exhaust the machine.
inline constexpr std::uint32_t kWidestLayer = 16384;
inline constexpr std::uint32_t kMostEpochs = 1000000;
inline constexpr std::uint32_t kLargestBatch = 1000000;

}  // namespace ravencal::learn
