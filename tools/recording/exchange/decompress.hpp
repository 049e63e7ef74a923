// SPDX-License-Identifier: Apache-2.0
//
// What the chunks of an MCAP file are compressed with. Private to exchange/.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace ravencal::exchange {

/// Bytes that were compressed with "zstd" or "lz4" (frames), or "" for not at all. Grows with what
/// comes out, so that a wrong `size` costs no memory. Errors (kData): another compression; damaged
/// bytes; more or fewer than `size` bytes come out.
core::Result<std::vector<std::uint8_t>> decompress(std::span<const std::uint8_t> bytes,
                                                   std::string_view compression,
                                                   std::uint64_t size);

}  // namespace ravencal::exchange
