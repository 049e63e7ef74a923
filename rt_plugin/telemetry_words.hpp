// SPDX-License-Identifier: Apache-2.0
//
// Records that one thread writes and others may read at any moment: kept as 64-bit words, each
// stored with release and loaded with acquire order. With a sequence around them (seqlock), a
// reader knows whether the words belong together; without fences, which thread sanitizers do not
// know. On x86 every access is a plain move.
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace ravencal::rt {

/// Storage of one Record, as words.
template <typename Record>
using Words = std::array<std::uint64_t, sizeof(Record) / sizeof(std::uint64_t)>;

inline void store_word(std::uint64_t& to, std::uint64_t value) noexcept {
  std::atomic_ref<std::uint64_t>(to).store(value, std::memory_order_release);
}

inline std::uint64_t load_word(const std::uint64_t& from) noexcept {
  // atomic_ref wants a mutable object even to read it.
  return std::atomic_ref<std::uint64_t>(const_cast<std::uint64_t&>(from))
      .load(std::memory_order_acquire);
}

/// Writes `record` to the words from `to` on.
template <typename Record>
void store_record(std::uint64_t* to, const Record& record) noexcept {
  static_assert(sizeof(Record) % sizeof(std::uint64_t) == 0);
  const auto words = std::bit_cast<Words<Record>>(record);
  for (std::size_t i = 0; i < words.size(); ++i) store_word(to[i], words[i]);
}

template <typename Record>
Record load_record(const std::uint64_t* from) noexcept {
  Words<Record> words;
  for (std::size_t i = 0; i < words.size(); ++i) words[i] = load_word(from[i]);
  return std::bit_cast<Record>(words);
}

}  // namespace ravencal::rt
