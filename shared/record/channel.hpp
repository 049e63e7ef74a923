// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ravencal::record {

/// What a channel means to the programs that read it.
enum class Role {
  kDesiredPosition,
  kDesiredVelocity,
  kMotorPosition,
  kMotorVelocity,
  kJointEstimate,  ///< what the robot believes
  kJointTruth,     ///< external encoder or tracker
  kTruthReading,   ///< what it read otherwise: counts, velocity; as little an input as the truth
  kDriveInput,
  kDriveTorque,
  kLoad,
  kTemperature,
  kStatus,
  kFeature,
};

/// Whether the channel comes from the external encoders: no model may have it as an input.
constexpr bool tells_truth(Role role) {
  return role == Role::kJointTruth || role == Role::kTruthReading;
}

/// "joint_estimate" etc.
std::string_view name_of(Role role);
std::optional<Role> role_from(std::string_view name);
/// Of all roles, for error messages.
std::vector<std::string> role_names();

/// One column of a recording. In memory and in files alike, names are unique within a recording.
struct Channel {
  std::string name;  ///< e.g. "jpos.elbow", "shoulder.motor_position"
  std::string unit;  ///< as stored; core/units.hpp. In-memory tables are always in SI units.
  Role role = Role::kFeature;
  std::string joint;  ///< e.g. "elbow"; empty if the channel belongs to no joint
};

}  // namespace ravencal::record
