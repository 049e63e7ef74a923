// SPDX-License-Identifier: Apache-2.0
#include "exchange/joint_message.hpp"

#include <fmt/format.h>

#include <iterator>
#include <utility>

#include "exchange/cdr_reader.hpp"

namespace ravencal::exchange {
namespace {

constexpr std::string_view kStates[] = {"position", "velocity", "effort"};
constexpr std::string_view kPointLists[] = {"position", "velocity", "acceleration", "effort"};
/// JointTrajectoryControllerState of ROS 2 Foxy, which may end behind them; of Humble, which
/// repeats the first two points at the end; of Jazzy. Nothing in a message says which.
constexpr std::size_t kPointsOfLayouts[] = {3, 6, 4};
constexpr std::string_view kPointNames[] = {"reference", "actual", "error", "command"};
constexpr std::size_t kTransform = 7;  // numbers of geometry_msgs/Transform
constexpr std::size_t kTwist = 6;
constexpr std::size_t kAlignment = 4;  // a writer may fill the last of them up

struct TypeName {
  std::string_view package, name;
  JointMessageType type;
};
constexpr TypeName kTypeNames[] = {
    {"sensor_msgs", "JointState", JointMessageType::kJointState},
    {"control_msgs", "DynamicJointState", JointMessageType::kDynamicJointState},
    {"control_msgs", "JointTrajectoryControllerState", JointMessageType::kControllerState},
};

JointMessage read_head(CdrReader& reader) {
  JointMessage message;
  const auto seconds = reader.number<std::int32_t>();
  const auto nanoseconds = reader.number<std::uint32_t>();
  message.stamp_ns = std::int64_t{seconds} * 1'000'000'000 + nanoseconds;
  (void)reader.text();  // frame_id
  message.names = reader.texts();
  return message;
}

/// Takes in a list of values; an empty one says nothing.
core::Status add(JointMessage& message, const std::string& quantity,
                 const std::vector<double>& values) {
  if (values.empty()) return {};
  if (values.size() != message.names.size()) {
    return core::data_error(
        fmt::format("it has {} names and {} values", message.names.size(), values.size()));
  }
  for (std::size_t joint = 0; joint < values.size(); ++joint)
    message.values.push_back({joint, quantity, values[joint]});
  return {};
}

core::Result<JointMessage> read_joint_state(CdrReader& reader) {
  JointMessage message = read_head(reader);
  for (const std::string_view name : kStates)
    RAVENCAL_RETURN_IF_ERROR(add(message, std::string(name), reader.numbers()));
  return message;
}

core::Result<JointMessage> read_dynamic_joint_state(CdrReader& reader) {
  JointMessage message = read_head(reader);
  const std::size_t joints = reader.length(2 * sizeof(std::uint32_t));
  if (joints != message.names.size()) {
    return core::data_error(
        fmt::format("it has {} names and interfaces of {}", message.names.size(), joints));
  }
  for (std::size_t joint = 0; joint < joints; ++joint) {
    std::vector<std::string> interfaces = reader.texts();
    const std::vector<double> values = reader.numbers();
    if (values.size() != interfaces.size()) {
      return core::data_error(fmt::format("'{}' has {} interfaces and {} values",
                                          message.names[joint], interfaces.size(), values.size()));
    }
    for (std::size_t i = 0; i < values.size(); ++i)
      message.values.push_back({joint, std::move(interfaces[i]), values[i]});
  }
  return message;
}

void skip_duration(CdrReader& reader) {
  (void)reader.number<std::int32_t>();
  (void)reader.number<std::uint32_t>();
}

core::Status read_point(CdrReader& reader, JointMessage& message, std::string_view point) {
  for (const std::string_view list : kPointLists) {
    RAVENCAL_RETURN_IF_ERROR(add(message, fmt::format("{}/{}", point, list), reader.numbers()));
  }
  skip_duration(reader);  // time_from_start
  return {};
}

core::Result<JointMessage> read_controller_state(CdrReader& reader, std::size_t points) {
  JointMessage message = read_head(reader);
  for (std::size_t i = 0; i < points; ++i) {
    if (i < std::size(kPointNames)) {
      RAVENCAL_RETURN_IF_ERROR(read_point(reader, message, kPointNames[i]));
    } else {
      JointMessage repeated;
      repeated.names = message.names;
      RAVENCAL_RETURN_IF_ERROR(read_point(reader, repeated, ""));
    }
  }
  if (points == kPointsOfLayouts[0] && reader.left() < kAlignment) return message;
  (void)reader.texts();  // joints of several degrees of freedom
  for (std::size_t i = 0; i < points; ++i) {
    (void)reader.numbers(kTransform);
    (void)reader.numbers(kTwist);
    (void)reader.numbers(kTwist);
    skip_duration(reader);
  }
  if (reader.left() < kAlignment) return message;
  return core::data_error(fmt::format("{} bytes follow it", reader.left()));
}

template <typename Read>
core::Result<JointMessage> whole(std::span<const std::uint8_t> bytes, std::string_view what,
                                 Read&& read) {
  try {
    CdrReader reader(bytes);
    return read(reader);
  } catch (const eprosima::fastcdr::exception::Exception&) {
    return core::data_error(fmt::format("its {} bytes are no {}", bytes.size(), what));
  }
}

core::Result<JointMessage> decode_controller_state(std::span<const std::uint8_t> bytes,
                                                   std::string_view what) {
  for (const std::size_t points : kPointsOfLayouts) {
    auto message = whole(bytes, what,
                         [&](CdrReader& reader) { return read_controller_state(reader, points); });
    if (message.ok()) return message;
  }
  return core::data_error(
      fmt::format("its {} bytes are no {} of 3, 4 or 6 points", bytes.size(), what));
}

}  // namespace

std::optional<JointMessageType> joint_message_type(std::string_view type) {
  for (const TypeName& known : kTypeNames) {
    if (type == fmt::format("{}/msg/{}", known.package, known.name) ||
        type == fmt::format("{}/{}", known.package, known.name))
      return known.type;
  }
  return std::nullopt;
}

core::Result<JointMessage> decode_joint_message(JointMessageType type,
                                                std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kEncapsulation = 4;
  if (bytes.size() < kEncapsulation || bytes[0] != 0 || bytes[1] > 1)
    return core::data_error("it does not begin as CDR does");
  const std::string_view what = kTypeNames[static_cast<std::size_t>(type)].name;
  switch (type) {
    case JointMessageType::kJointState:
      return whole(bytes, what, read_joint_state);
    case JointMessageType::kDynamicJointState:
      return whole(bytes, what, read_dynamic_joint_state);
    case JointMessageType::kControllerState:
      return decode_controller_state(bytes, what);
  }
  return core::data_error("its type is unknown");
}

}  // namespace ravencal::exchange
