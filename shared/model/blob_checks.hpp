// SPDX-License-Identifier: Apache-2.0
//
// Checks that the parts of a blob's validation share. Offsets count from the start of `bytes`.
#pragma once

#include <cstddef>
#include <span>

#include "model/blob_status.hpp"

namespace ravencal::model {

/// Every byte in [from, to) is zero.
inline BlobCheck check_zero(std::span<const std::byte> bytes, std::size_t from,
                            std::size_t to) noexcept {
  for (std::size_t i = from; i < to; ++i) {
    if (bytes[i] != std::byte{0}) return {BlobStatus::kReserved, i};
  }
  return {};
}

/// Characters of a zero-padded text of printable ASCII, at least `lowest`, that ends with at least
/// one zero; `capacity` for what is no such text.
inline std::size_t text_length(std::span<const std::byte> bytes, std::size_t from,
                               std::size_t capacity, unsigned char lowest) noexcept {
  std::size_t length = 0;
  while (length < capacity && bytes[from + length] != std::byte{0}) {
    const auto c = static_cast<unsigned char>(bytes[from + length]);
    if (c < lowest || c >= 0x7F) return capacity;
    ++length;
  }
  return check_zero(bytes, from + length, from + capacity).ok() ? length : capacity;
}

/// A zero-padded text of at least one printable ASCII character and no blank.
inline bool is_name(std::span<const std::byte> bytes, std::size_t from,
                    std::size_t capacity) noexcept {
  const std::size_t length = text_length(bytes, from, capacity, '!');
  return length > 0 && length < capacity;
}

}  // namespace ravencal::model
