// SPDX-License-Identifier: Apache-2.0
//
// What the CSV fuzzer and the test that replays its corpus do with one input.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

namespace ravencal::fuzz {

/// Loads the bytes as a CSV in several ways (first byte: which), through files in `folder`. Aborts
/// if a promise of the reader is broken: a recording that violates its invariants, or an error
/// without the file's name.
void try_csv(std::span<const std::uint8_t> bytes, const std::filesystem::path& folder);

}  // namespace ravencal::fuzz
