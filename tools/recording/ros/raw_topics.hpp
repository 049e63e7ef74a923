// SPDX-License-Identifier: Apache-2.0
//
// Topics and services of ROS 1 whose messages are bytes with a type beside them, so that no message
// package is needed. A subscriber accepts every type under the name and learns it, so that a
// message of another revision gives a message to the user; roscpp would stay silent. Callbacks come
// from ROS's spinner threads.
#pragma once

#include <ros/ros.h>

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "record/raven_state_message.hpp"
#include "record/ros_raw_message.hpp"

namespace ravencal::ros_io {

/// A message as it comes off the wire.
struct AnyMessage {
  std::vector<std::uint8_t> bytes;
};

/// Says which type a publisher sends; empty strings where it does not say.
struct ReceivedType {
  std::string name;
  std::string md5;
};

using TakeBytes =
    std::function<void(std::span<const std::uint8_t> bytes, const ReceivedType& type)>;

ros::Publisher advertise(ros::NodeHandle& node, const std::string& topic,
                         const record::RosMessageType& type, std::uint32_t queue);
void publish(ros::Publisher& publisher, const record::RosMessageType& type,
             std::vector<std::uint8_t> bytes);
/// TCP without Nagle's delay.
ros::Subscriber subscribe(ros::NodeHandle& node, const std::string& topic, std::uint32_t queue,
                          const TakeBytes& take);

/// std_srvs: Trigger (no request) or SetBool. The answer is success and a sentence.
struct Answer {
  bool success = false;
  std::string message;
};
ros::ServiceServer serve_trigger(ros::NodeHandle& node, const std::string& name,
                                 const std::function<Answer()>& call);
ros::ServiceServer serve_set_bool(ros::NodeHandle& node, const std::string& name,
                                  const std::function<Answer(bool)>& call);

/// "ravenstate is published as a/b with md5 X; ravencal knows ..." if the types differ.
std::string type_mismatch(const std::string& topic, const ReceivedType& received,
                          const record::RosMessageType& expected);

}  // namespace ravencal::ros_io

namespace ros {

namespace message_traits {
template <>
struct IsMessage<ravencal::ros_io::AnyMessage> : TrueType {};
template <>
struct MD5Sum<ravencal::ros_io::AnyMessage> {
  static const char* value() { return "*"; }
  static const char* value(const ravencal::ros_io::AnyMessage& /*message*/) { return value(); }
};
template <>
struct DataType<ravencal::ros_io::AnyMessage> {
  static const char* value() { return "*"; }
  static const char* value(const ravencal::ros_io::AnyMessage& /*message*/) { return value(); }
};
template <>
struct Definition<ravencal::ros_io::AnyMessage> {
  static const char* value() { return ""; }
  static const char* value(const ravencal::ros_io::AnyMessage& /*message*/) { return value(); }
};
}  // namespace message_traits

namespace serialization {
template <>
struct Serializer<ravencal::ros_io::AnyMessage> {
  template <typename Stream>
  static void read(Stream& stream, ravencal::ros_io::AnyMessage& message) {
    const std::uint32_t length = stream.getLength();
    const std::uint8_t* from = stream.advance(length);
    message.bytes.assign(from, from + length);
  }
};
}  // namespace serialization
}  // namespace ros
