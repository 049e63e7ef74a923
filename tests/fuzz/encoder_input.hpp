// SPDX-License-Identifier: Apache-2.0
//
// What the encoders' fuzzer and the replay of its corpus have in common: bytes to calls, and the
// promises that must hold whatever the bytes are.
#pragma once

#include <cstdint>
#include <span>

namespace ravencal::fuzz {

/// The first byte chooses: CAN frames, configuration text, readings of an axis, a recording to
/// replay. Aborts (libFuzzer) where a promise is broken.
void try_encoder(std::span<const std::uint8_t> bytes);

}  // namespace ravencal::fuzz
