// SPDX-License-Identifier: Apache-2.0
//
// The CRTK messages of the RAVEN-II controller as bytes, beside those of record/. Types of
// crtk_msgs 1.0.0 (operating_state, StringStamped) and geometry_msgs/TransformStamped. Needs no
// ROS. Any thread.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "record/raven_state_message.hpp"

namespace ravencal::ros_io {

const record::RosMessageType& operating_state_type();
const record::RosMessageType& string_stamped_type();
const record::RosMessageType& transform_stamped_type();

struct OperatingStateMessage {
  std::int64_t stamp_ns = 0;
  std::string state;  ///< DISABLED, ENABLED, PAUSED, FAULT
  bool is_homed = false;
  bool is_busy = false;
};
std::vector<std::uint8_t> encode_operating_state(const OperatingStateMessage& message);
/// nullopt if the bytes are not such a message.
std::optional<OperatingStateMessage> decode_operating_state(std::span<const std::uint8_t> bytes);

struct StringMessage {
  std::int64_t stamp_ns = 0;
  std::string text;
};
std::vector<std::uint8_t> encode_string_stamped(const StringMessage& message);
std::optional<StringMessage> decode_string_stamped(std::span<const std::uint8_t> bytes);

/// Pose as translation [m] and row-major rotation.
struct PoseMessage {
  std::int64_t stamp_ns = 0;
  std::string child_frame;
  std::array<double, 3> position_m{};
  std::array<double, 9> rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};
};
std::vector<std::uint8_t> encode_transform_stamped(const PoseMessage& message);

}  // namespace ravencal::ros_io
