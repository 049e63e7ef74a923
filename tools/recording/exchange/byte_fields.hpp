// SPDX-License-Identifier: Apache-2.0
//
// Little-endian fields one after the other, as MCAP has them: texts with a u32 of their bytes
// before them, lists with a u64 of their numbers. Private to exchange/.
#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

namespace ravencal::exchange {

/// Each is false where the bytes end before the field.
class FieldReader {
 public:
  explicit FieldReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <typename T>
  bool number(T& value) {
    if (bytes_.size() < sizeof(T)) return false;
    std::memcpy(&value, bytes_.data(), sizeof(T));
    bytes_ = bytes_.subspan(sizeof(T));
    return true;
  }
  bool text(std::string& value) {
    std::uint32_t size = 0;
    if (!number(size) || size > bytes_.size()) return false;
    value.assign(bytes_.begin(), bytes_.begin() + size);
    bytes_ = bytes_.subspan(size);
    return true;
  }
  template <typename T>
  bool numbers(std::vector<T>& values) {
    std::uint64_t count = 0;
    if (!number(count) || count > bytes_.size() / sizeof(T)) return false;
    values.resize(static_cast<std::size_t>(count));
    if (!values.empty()) std::memcpy(values.data(), bytes_.data(), values.size() * sizeof(T));
    bytes_ = bytes_.subspan(values.size() * sizeof(T));
    return true;
  }
  [[nodiscard]] std::span<const std::uint8_t> rest() const { return bytes_; }

 private:
  std::span<const std::uint8_t> bytes_;
};

class FieldWriter {
 public:
  template <typename T>
  void number(T value) {
    append(&value, sizeof(T));
  }
  void text(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size()));
    append(value.data(), value.size());
  }
  template <typename T>
  void numbers(std::span<const T> values) {
    number(std::uint64_t{values.size()});
    append(values.data(), values.size_bytes());
  }
  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return bytes_; }

 private:
  void append(const void* from, std::size_t count) {
    const auto* const first = static_cast<const std::uint8_t*>(from);
    bytes_.insert(bytes_.end(), first, first + count);
  }

  std::vector<std::uint8_t> bytes_;
};

}  // namespace ravencal::exchange
