// SPDX-License-Identifier: Apache-2.0
//
// CDR that is not trusted: what a list claims must be there. Private to exchange/.
#pragma once

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace ravencal::exchange {

/// Throws eprosima::fastcdr::exception::Exception where the bytes end before the value.
class CdrReader {
 public:
  explicit CdrReader(std::span<const std::uint8_t> bytes)
      : size_(bytes.size()),
        // The buffer is read only, but its owner takes a pointer to mutable bytes.
        buffer_(reinterpret_cast<char*>(const_cast<std::uint8_t*>(bytes.data())), bytes.size()),
        cdr_(buffer_, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN, eprosima::fastcdr::Cdr::DDS_CDR) {
    cdr_.read_encapsulation();
  }

  template <typename T>
  T number() {
    T value{};
    cdr_ >> value;
    return value;
  }
  std::string text() {
    std::string value;
    cdr_ >> value;
    return value;
  }
  std::vector<std::string> texts() {
    const std::size_t count = length(sizeof(std::uint32_t));
    std::vector<std::string> values;
    for (std::size_t i = 0; i < count; ++i) values.push_back(text());
    return values;
  }
  /// A list of so many numbers each.
  std::vector<double> numbers(std::size_t each = 1) {
    std::vector<double> values(each * length(each * sizeof(double)));
    if (!values.empty()) cdr_.deserializeArray(values.data(), values.size());
    return values;
  }
  /// How many elements follow.
  std::size_t length(std::size_t least_bytes_each) {
    const auto count = number<std::uint32_t>();
    if (count > left() / least_bytes_each)
      throw eprosima::fastcdr::exception::NotEnoughMemoryException(
          "a list is longer than the message");
    return count;
  }
  [[nodiscard]] std::size_t left() const {
    return size_ - std::min(size_, cdr_.getSerializedDataLength());
  }

 private:
  std::size_t size_;
  eprosima::fastcdr::FastBuffer buffer_;
  eprosima::fastcdr::Cdr cdr_;
};

}  // namespace ravencal::exchange
