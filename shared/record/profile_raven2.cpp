// SPDX-License-Identifier: Apache-2.0
//
// Column meanings: HaonanPeng/raven2_CRTK_Python_controller, bag_reader/run_r2_bag_readers_sync.py.
#include <fmt/format.h>

#include "core/catalogue.hpp"
#include "core/joint_layout.hpp"
#include "record/profile_builtin.hpp"

namespace ravencal::record {
namespace {

using core::CatalogueEntry;
using core::RavenField;

bool is_calibrated(std::size_t slot) { return slot < core::kCalibratedJointCount; }

Role role_of(const CatalogueEntry& entry) {
  const bool is_void = entry.joint_slot == static_cast<std::size_t>(core::JointSlot::kVoid);
  if (entry.field == RavenField::kRunlevel || entry.field == RavenField::kSublevel) {
    return Role::kStatus;
  }
  if (entry.other_arm || is_void) return Role::kFeature;
  switch (entry.field) {
    case RavenField::kJpos:
      return is_calibrated(entry.joint_slot) ? Role::kJointEstimate : Role::kFeature;
    case RavenField::kMpos:
      return Role::kMotorPosition;
    case RavenField::kMvel:
      return Role::kMotorVelocity;
    case RavenField::kJposD:
      return Role::kDesiredPosition;
    case RavenField::kTau:
      return Role::kDriveTorque;
    case RavenField::kDac:
      return Role::kDriveInput;
    default:
      return Role::kFeature;
  }
}

ProfileChannel truth_channel(std::size_t joint) {
  const std::string name(core::kSlotNames[joint]);
  ProfileChannel channel;
  channel.channel = {"truth." + name, std::string(core::kSlotUnits[joint]), Role::kJointTruth,
                     name};
  channel.index = joint + 1;
  return channel;
}

ProfileChannel catalogue_channel(std::size_t index, bool gold) {
  const CatalogueEntry& entry = core::catalogue()[index];
  const bool has_joint = !entry.other_arm && entry.joint_slot != core::kNoJoint;
  ProfileChannel channel;
  channel.channel = {entry.name, entry.message_unit, role_of(entry),
                     has_joint ? std::string(core::kSlotNames[entry.joint_slot]) : std::string()};
  channel.index = raven2_column(index, gold);
  // The authors train on the time since the start; the stamp itself counts from 1970.
  channel.relative = entry.field == RavenField::kTime;
  return channel;
}

}  // namespace

std::size_t raven2_column(std::size_t catalogue_index, bool gold) {
  const CatalogueEntry& entry = core::catalogue()[catalogue_index];
  const bool second = core::info_of(entry.field).per_arm && entry.other_arm == gold;
  return kRaven2CatalogueColumn + core::catalogue_index(entry.field, entry.element, second);
}

core::Result<Profile> raven2_profile(const std::string& arm) {
  if (arm != "gold" && arm != "green") {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("profile raven2: arm '{}'; it is gold or green", arm)};
  }
  Profile profile;
  profile.name = "raven2";
  profile.robot = "RAVEN-II";
  profile.header = false;
  profile.time_index = 0;
  profile.column_count = kRaven2ColumnCount;
  profile.arm = arm;
  for (std::size_t j = 0; j < core::kCalibratedJointCount; ++j) {
    profile.channels.push_back(truth_channel(j));
  }
  for (std::size_t i = 0; i < core::kCatalogueSize; ++i) {
    profile.channels.push_back(catalogue_channel(i, arm == "gold"));
  }
  return profile;
}

core::Result<Profile> raven2_bag_profile(const std::string& arm) {
  RAVENCAL_ASSIGN_OR_RETURN(Profile profile, raven2_profile(arm));
  profile.name = "raven2-bag";
  profile.format = "bag";
  return profile;
}

}  // namespace ravencal::record
