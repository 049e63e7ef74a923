// SPDX-License-Identifier: Apache-2.0
//
// ROS 1 serialisation: little-endian numbers one after the other, arrays and strings behind their
// length where that is not fixed. For those who speak ROS without its message packages.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace ravencal::record {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they are");

inline constexpr std::int64_t kRosSecondNs = 1'000'000'000;

/// Reads past the end give zeros and fail().
class RosReader {
 public:
  explicit RosReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <typename T>
  T number() {
    static_assert(std::is_arithmetic_v<T>);
    T value{};
    if (const auto* from = take(sizeof(T))) std::memcpy(&value, from, sizeof(T));
    return value;
  }
  std::string text() {
    const auto length = number<std::uint32_t>();
    const auto* from = take(length);
    return from == nullptr ? std::string() : std::string(from, from + length);
  }
  /// Elements of an array whose length comes before it; none if they cannot all be there.
  std::size_t count(std::size_t smallest_element_bytes) {
    const std::size_t n = number<std::uint32_t>();
    if (n <= left() / smallest_element_bytes) return n;
    failed_ = true;
    return 0;
  }
  /// std_msgs/Header: its stamp in ns; sequence number and frame are left out.
  std::int64_t header() {
    (void)number<std::uint32_t>();
    const auto seconds = number<std::uint32_t>();
    const auto nanoseconds = number<std::uint32_t>();
    (void)text();
    return std::int64_t{seconds} * kRosSecondNs + nanoseconds;
  }
  /// True if the bytes were exactly what was read.
  [[nodiscard]] bool whole() const { return !failed_ && left() == 0; }

  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  [[nodiscard]] bool failed() const { return failed_; }

 private:
  const std::uint8_t* take(std::size_t n) {
    if (failed_ || n > left()) {
      failed_ = true;
      return nullptr;
    }
    const std::uint8_t* from = bytes_.data() + at_;
    at_ += n;
    return from;
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool failed_ = false;
};

class RosWriter {
 public:
  template <typename T>
  void number(T value) {
    static_assert(std::is_arithmetic_v<T>);
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    std::memcpy(bytes_.data() + at, &value, sizeof(T));
  }
  void text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size()));
    bytes_.insert(bytes_.end(), value.begin(), value.end());
  }
  /// std_msgs/Header; its sequence number is zero, as publishers leave it.
  void header(std::int64_t stamp_ns, std::string_view frame = {}) {
    number(std::uint32_t{0});
    number(static_cast<std::uint32_t>(stamp_ns / kRosSecondNs));
    number(static_cast<std::uint32_t>(stamp_ns % kRosSecondNs));
    text(frame);
  }

  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  std::vector<std::uint8_t> bytes_;
};

}  // namespace ravencal::record
