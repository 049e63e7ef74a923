// SPDX-License-Identifier: Apache-2.0
//
// The two ROS 1 messages of a RAVEN-II with external encoders, as bytes: raven_2/raven_state, what
// the controller says every millisecond, and sensor_msgs/JointState, in which the joint encoders'
// values travel. Written from the published field tables; needs no ROS. Any thread.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/catalogue.hpp"

namespace ravencal::record {

/// What a subscriber or a bag needs to know of a message type.
struct RosMessageType {
  std::string_view name;        ///< e.g. "raven_2/raven_state"
  std::string_view md5;         ///< of the definition, by ROS's rule
  std::string_view definition;  ///< with those of the types in it
};

/// Since e6bcd26 of uw-biorobotics/raven2 (2016); raven_state's field table of that revision.
const RosMessageType& raven_state_type();
const RosMessageType& joint_state_type();

struct RavenStateMessage {
  std::int64_t stamp_ns = 0;  ///< hdr.stamp: CLOCK_REALTIME at publishing
  std::int64_t dt_ns = 0;     ///< since the message before
  /// By catalogue index, in the units of the message; kTime is the stamp in seconds.
  std::array<double, core::kCatalogueSize> values{};
};

/// `gold`: the calibrated arm's values are the first half of each per-arm field, else the second.
/// nullopt if the size is not that of the message.
std::optional<RavenStateMessage> decode_raven_state(std::span<const std::uint8_t> bytes, bool gold);
/// Integers are rounded, floating-point fields are float32. NaN is not a number in integer fields
/// either: it becomes 0.
std::vector<std::uint8_t> encode_raven_state(const RavenStateMessage& message, bool gold);

struct JointStateMessage {
  std::int64_t stamp_ns = 0;
  std::vector<std::string> names;
  std::vector<double> positions;
  std::vector<double> velocities;
};

/// nullopt if the bytes are not such a message.
std::optional<JointStateMessage> decode_joint_state(std::span<const std::uint8_t> bytes);
std::vector<std::uint8_t> encode_joint_state(const JointStateMessage& message);

}  // namespace ravencal::record
