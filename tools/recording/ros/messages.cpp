// SPDX-License-Identifier: Apache-2.0
#include "ros/messages.hpp"

#include <Eigen/Geometry>

#include "record/ros_bytes.hpp"

namespace ravencal::ros_io {
namespace {

using record::RosReader;
using record::RosWriter;

constexpr std::string_view kHeader =
    "================================================================================\n"
    "MSG: std_msgs/Header\n"
    "uint32 seq\n"
    "time stamp\n"
    "string frame_id\n";

constexpr std::string_view kOperatingState =
    "Header header\n"
    "string state\n"
    "bool is_homed\n"
    "bool is_busy\n";

constexpr std::string_view kStringStamped =
    "Header header\n"
    "string string\n";

constexpr std::string_view kTransformStamped =
    "Header header\n"
    "string child_frame_id\n"
    "Transform transform\n";

constexpr std::string_view kTransform =
    "================================================================================\n"
    "MSG: geometry_msgs/Transform\n"
    "Vector3 translation\n"
    "Quaternion rotation\n"
    "================================================================================\n"
    "MSG: geometry_msgs/Vector3\n"
    "float64 x\n"
    "float64 y\n"
    "float64 z\n"
    "================================================================================\n"
    "MSG: geometry_msgs/Quaternion\n"
    "float64 x\n"
    "float64 y\n"
    "float64 z\n"
    "float64 w\n";

std::string joined(std::string_view fields, std::string_view more = {}) {
  std::string text(fields);
  text += kHeader;
  text += more;
  return text;
}

}  // namespace

const record::RosMessageType& operating_state_type() {
  static const std::string definition = joined(kOperatingState);
  static const record::RosMessageType type{"crtk_msgs/operating_state",
                                           "b1bd4021639d9d9c5fbfff78d6ff3158", definition};
  return type;
}

const record::RosMessageType& string_stamped_type() {
  static const std::string definition = joined(kStringStamped);
  static const record::RosMessageType type{"crtk_msgs/StringStamped",
                                           "5e3e46086181199270f1ac3a28a5977f", definition};
  return type;
}

const record::RosMessageType& transform_stamped_type() {
  static const std::string definition = joined(kTransformStamped, kTransform);
  static const record::RosMessageType type{"geometry_msgs/TransformStamped",
                                           "b5764a33bfeb3588febc2682852579b0", definition};
  return type;
}

std::vector<std::uint8_t> encode_operating_state(const OperatingStateMessage& message) {
  RosWriter writer;
  writer.header(message.stamp_ns);
  writer.text(message.state);
  writer.number(static_cast<std::uint8_t>(message.is_homed));
  writer.number(static_cast<std::uint8_t>(message.is_busy));
  return writer.take();
}

std::optional<OperatingStateMessage> decode_operating_state(std::span<const std::uint8_t> bytes) {
  RosReader reader(bytes);
  OperatingStateMessage message;
  message.stamp_ns = reader.header();
  message.state = reader.text();
  message.is_homed = reader.number<std::uint8_t>() != 0;
  message.is_busy = reader.number<std::uint8_t>() != 0;
  return reader.whole() ? std::optional(message) : std::nullopt;
}

std::vector<std::uint8_t> encode_string_stamped(const StringMessage& message) {
  RosWriter writer;
  writer.header(message.stamp_ns);
  writer.text(message.text);
  return writer.take();
}

std::optional<StringMessage> decode_string_stamped(std::span<const std::uint8_t> bytes) {
  RosReader reader(bytes);
  StringMessage message;
  message.stamp_ns = reader.header();
  message.text = reader.text();
  return reader.whole() ? std::optional(message) : std::nullopt;
}

std::vector<std::uint8_t> encode_transform_stamped(const PoseMessage& message) {
  const Eigen::Quaterniond turned(Eigen::Matrix3d(
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(message.rotation.data())));
  RosWriter writer;
  writer.header(message.stamp_ns);
  writer.text(message.child_frame);
  for (const double value : message.position_m) writer.number(value);
  for (const double value : {turned.x(), turned.y(), turned.z(), turned.w()}) writer.number(value);
  return writer.take();
}

}  // namespace ravencal::ros_io
