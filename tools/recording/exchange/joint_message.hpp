// SPDX-License-Identifier: Apache-2.0
//
// Messages of ROS 2 that hold values of named joints, as CDR (OMG DDS-RTPS 2.2, 10; either byte
// order).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace ravencal::exchange {

/// In the order in which a measured quantity is taken where several topics have it.
enum class JointMessageType {
  kJointState,         ///< sensor_msgs/msg/JointState
  kDynamicJointState,  ///< control_msgs/msg/DynamicJointState
  kControllerState,    ///< control_msgs/msg/JointTrajectoryControllerState
};
inline constexpr std::string_view kJointMessageTypes =
    "sensor_msgs/msg/JointState, control_msgs/msg/DynamicJointState or "
    "control_msgs/msg/JointTrajectoryControllerState";

/// The type of a topic, with or without "/msg"; none: its messages hold no joints.
std::optional<JointMessageType> joint_message_type(std::string_view type);

struct JointValue {
  std::size_t joint = 0;  ///< of the names
  std::string quantity;   ///< "position", "reference/velocity"
  double value = 0.0;
};

/// One message, in SI units; what it leaves out is not there.
struct JointMessage {
  std::int64_t stamp_ns = 0;  ///< since 1970; 0: the publisher set none
  std::vector<std::string> names;
  std::vector<JointValue> values;
};

/// Takes a serialised message apart. A controller's set point is "reference/...", whether the
/// message calls it reference or desired, what it measures "actual/..." (feedback or actual), what
/// it puts out "command/..." (output). Errors (kData) say what is wrong, without the file.
core::Result<JointMessage> decode_joint_message(JointMessageType type,
                                                std::span<const std::uint8_t> bytes);

}  // namespace ravencal::exchange
