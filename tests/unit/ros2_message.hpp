// SPDX-License-Identifier: Apache-2.0
//
// Messages of ROS 2 as CDR of the little-endian kind (OMG DDS-RTPS 2.2, 10): each number at a
// multiple of its size behind the four bytes that say so.
#pragma once

#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "record/table.hpp"

namespace ravencal::test {

inline constexpr std::int64_t kStart = 1'700'000'000'000'000'000;
inline constexpr std::int64_t kMs = 1'000'000;

inline const std::vector<double>& values_of(const record::Table& table, const std::string& name) {
  for (const record::TableColumn& column : table.columns) {
    if (column.name == name) return column.values;
  }
  throw std::runtime_error("no column " + name);
}

class CdrWriter {
 public:
  CdrWriter(std::int64_t stamp_ns, const std::vector<std::string>& names) {
    number(static_cast<std::int32_t>(stamp_ns / 1'000'000'000));
    number(static_cast<std::uint32_t>(stamp_ns % 1'000'000'000));
    text("frame");
    texts(names);
  }

  template <typename T>
  CdrWriter& number(T value) {
    while ((bytes_.size() - 4) % sizeof(value) != 0) bytes_ += '\0';
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value));
    return *this;
  }
  CdrWriter& text(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size() + 1));
    bytes_.append(value.c_str(), value.size() + 1);
    return *this;
  }
  CdrWriter& texts(const std::vector<std::string>& values) {
    number(static_cast<std::uint32_t>(values.size()));
    for (const std::string& value : values) text(value);
    return *this;
  }
  CdrWriter& numbers(const std::vector<double>& values) {
    number(static_cast<std::uint32_t>(values.size()));
    for (const double value : values) number(value);
    return *this;
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_ = std::string("\0\1\0\0", 4);
};

/// sensor_msgs/msg/JointState
inline std::string joint_state(std::int64_t stamp_ns, const std::vector<std::string>& names,
                               const std::vector<double>& position,
                               const std::vector<double>& velocity = {},
                               const std::vector<double>& effort = {}) {
  return CdrWriter(stamp_ns, names).numbers(position).numbers(velocity).numbers(effort).bytes();
}

inline std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace ravencal::test
