// SPDX-License-Identifier: Apache-2.0
//
// Which inputs answer to the motor command within a cycle or two, and so close a loop through the
// correction: the one list of them. The correction is subtracted from the desired joints; the servo
// (PD on motor position) turns that into torque in the same cycle, the torque into velocity in the
// next, and the desired positions themselves contain the correction. Measured positions answer as
// well, but only as fast as the servo moves the arm; tools/deployment/loop counts them in the whole
// loop.
#pragma once

#include <optional>
#include <string_view>

#include "core/catalogue.hpp"
#include "core/joint_layout.hpp"
#include "model/kinds.hpp"

namespace ravencal::model {

/// The group of a raven_state field; none for fields that do not answer.
constexpr std::optional<LoopGroup> loop_group_of(core::RavenField field) {
  switch (field) {
    case core::RavenField::kTau:
    case core::RavenField::kDac:
    case core::RavenField::kJacF:
      return LoopGroup::kTorque;
    case core::RavenField::kMvel:
    case core::RavenField::kJvel:
    case core::RavenField::kJacVel:
      return LoopGroup::kVelocity;
    case core::RavenField::kMposD:
    case core::RavenField::kJposD:
    case core::RavenField::kPosD:
    case core::RavenField::kOriD:
      return LoopGroup::kDesired;
    default:
      return std::nullopt;
  }
}

/// The group of a channel: of the calibrated arm, and where it belongs to a joint, of joints 1 to
/// 3, for the correction moves no other. None for channels that are not of raven_state.
inline std::optional<LoopGroup> loop_group_of(std::string_view channel) {
  const auto index = core::catalogue_index_of(channel);
  if (!index) return std::nullopt;
  const core::CatalogueEntry& entry = core::catalogue()[*index];
  const bool other_joint =
      entry.joint_slot != core::kNoJoint && entry.joint_slot >= core::kCalibratedJointCount;
  if (entry.other_arm || other_joint) return std::nullopt;
  return loop_group_of(entry.field);
}

}  // namespace ravencal::model
