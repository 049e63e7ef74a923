// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <new>
#include <span>

namespace ravencal::rt {

/// Hands out aligned pieces of one block of memory; without a block it only counts bytes.
class Layout {
 public:
  static constexpr std::size_t kAlignment = 64;  ///< of every piece: a cache line

  explicit Layout(std::byte* start) noexcept : start_(start) {}

  template <typename T>
  std::span<T> take(std::size_t count) noexcept {
    const std::size_t at = used_;
    used_ += (count * sizeof(T) + kAlignment - 1) / kAlignment * kAlignment;
    if (start_ == nullptr) return {};
    T* const first = reinterpret_cast<T*>(start_ + at);
    for (std::size_t i = 0; i < count; ++i) new (first + i) T{};
    return {first, count};
  }
  [[nodiscard]] std::size_t used() const noexcept { return used_; }

 private:
  std::byte* start_;
  std::size_t used_ = 0;
};

}  // namespace ravencal::rt
