// SPDX-License-Identifier: Apache-2.0
//
// A message that ROS hands on as the bytes that it is, with its type beside it. Only for builds
// that have ROS's headers.
#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "record/raven_state_message.hpp"

namespace ravencal::record {

struct RosRawMessage {
  const RosMessageType* type = nullptr;
  std::vector<std::uint8_t> bytes;
};

}  // namespace ravencal::record

namespace ros {

namespace message_traits {

template <>
struct IsMessage<ravencal::record::RosRawMessage> : TrueType {};

template <>
struct MD5Sum<ravencal::record::RosRawMessage> {
  static const char* value(const ravencal::record::RosRawMessage& message) {
    return message.type->md5.data();
  }
};
template <>
struct DataType<ravencal::record::RosRawMessage> {
  static const char* value(const ravencal::record::RosRawMessage& message) {
    return message.type->name.data();
  }
};
template <>
struct Definition<ravencal::record::RosRawMessage> {
  static const char* value(const ravencal::record::RosRawMessage& message) {
    return message.type->definition.data();
  }
};

}  // namespace message_traits

namespace serialization {

template <>
struct Serializer<ravencal::record::RosRawMessage> {
  template <typename Stream>
  static void write(Stream& stream, const ravencal::record::RosRawMessage& message) {
    const auto length = static_cast<std::uint32_t>(message.bytes.size());
    std::memcpy(stream.advance(length), message.bytes.data(), length);
  }
  static std::uint32_t serializedLength(const ravencal::record::RosRawMessage& message) {
    return static_cast<std::uint32_t>(message.bytes.size());
  }
};

}  // namespace serialization
}  // namespace ros
