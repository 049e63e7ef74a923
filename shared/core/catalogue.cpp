// SPDX-License-Identifier: Apache-2.0
#include "core/catalogue.hpp"

#include <algorithm>
#include <unordered_map>
#include <vector>

#include "core/joint_layout.hpp"

namespace ravencal::core {
namespace {

constexpr std::array<std::string_view, kFeatureGroupCount> kGroupNames = {
    "time_and_state", "joint_pose", "motor_pose",    "end_effector_pose", "velocity", "torque",
    "current",        "jacobian",   "encoder_value", "encoder_offset",    "void"};

FeatureGroup group_of(RavenField field) {
  switch (field) {
    case RavenField::kTime:
    case RavenField::kRunlevel:
    case RavenField::kSublevel:
    case RavenField::kLastSeq:
    case RavenField::kType:
    case RavenField::kGraspD:
      return FeatureGroup::kTimeAndState;
    case RavenField::kJpos:
    case RavenField::kJposD:
      return FeatureGroup::kJointPose;
    case RavenField::kMpos:
    case RavenField::kMposD:
      return FeatureGroup::kMotorPose;
    case RavenField::kPos:
    case RavenField::kPosD:
    case RavenField::kOri:
    case RavenField::kOriD:
      return FeatureGroup::kEndEffectorPose;
    case RavenField::kMvel:
    case RavenField::kJvel:
      return FeatureGroup::kVelocity;
    case RavenField::kTau:
      return FeatureGroup::kTorque;
    case RavenField::kJacVel:
    case RavenField::kJacF:
      return FeatureGroup::kJacobian;
    case RavenField::kDac:
      return FeatureGroup::kCurrent;
    case RavenField::kEncVals:
      return FeatureGroup::kEncoderValue;
    case RavenField::kEncOffsets:
      return FeatureGroup::kEncoderOffset;
  }
  return FeatureGroup::kTimeAndState;
}

std::string element_name(const RavenFieldInfo& info, std::size_t element) {
  if (info.per_joint) {
    return std::string(kSlotNames[element]);
  }
  switch (info.count) {
    case 3:
      return std::string(1, "xyz"[element]);
    case 9:
      return "r" + std::to_string(element / 3 + 1) + std::to_string(element % 3 + 1);
    default:
      return std::to_string(element);
  }
}

bool is_position(RavenField field) {
  return field == RavenField::kJpos || field == RavenField::kJposD;
}

// The controller multiplies every joint position by 180/pi, the prismatic one in metres included.
std::pair<std::string, std::string> units_of(RavenField field, std::size_t element) {
  const std::string_view unit = info_of(field).message_unit;
  const bool prismatic = element == static_cast<std::size_t>(JointSlot::kInsertion);
  if (prismatic && is_position(field)) return {"m_x_180_over_pi", "m"};
  if (prismatic && field == RavenField::kJvel) return {"m_per_s_x_180_over_pi", "m_per_s"};
  if (unit == "deg") return {"deg", "rad"};
  if (unit == "deg_per_s") return {"deg_per_s", "rad_per_s"};
  if (unit == "um") return {"um", "m"};
  return {std::string(unit), std::string(unit)};
}

CatalogueEntry make_entry(RavenField field, std::size_t element, bool other_arm) {
  const RavenFieldInfo& info = info_of(field);
  const bool is_void = info.per_joint && element == static_cast<std::size_t>(JointSlot::kVoid);
  auto [message_unit, si_unit] = units_of(field, info.per_joint ? element : kNoJoint);
  std::string name = other_arm ? "other." : "";
  name += info.name;
  if (info.count > 1) name += "." + element_name(info, element);
  return {std::move(name),
          field,
          is_void ? FeatureGroup::kVoid : group_of(field),
          element,
          info.per_joint ? element : kNoJoint,
          other_arm,
          std::move(message_unit),
          std::move(si_unit),
          !other_arm && !is_void};
}

std::vector<CatalogueEntry> build_catalogue() {
  std::vector<CatalogueEntry> entries(kCatalogueSize);
  for (std::size_t f = 0; f < kRavenFieldCount; ++f) {
    const auto field = static_cast<RavenField>(f);
    const RavenFieldInfo& info = info_of(field);
    for (int arm = 0; arm < (info.per_arm ? 2 : 1); ++arm) {
      for (std::size_t e = 0; e < info.count; ++e) {
        entries[catalogue_index(field, e, arm == 1)] = make_entry(field, e, arm == 1);
      }
    }
  }
  return entries;
}

const std::vector<CatalogueEntry>& entries() {
  static const std::vector<CatalogueEntry> all = build_catalogue();
  return all;
}

}  // namespace

std::string_view name_of(FeatureGroup group) {
  return kGroupNames[static_cast<std::size_t>(group)];
}

std::optional<FeatureGroup> feature_group_from(std::string_view name) {
  const auto it = std::find(kGroupNames.begin(), kGroupNames.end(), name);
  if (it == kGroupNames.end()) return std::nullopt;
  return static_cast<FeatureGroup>(it - kGroupNames.begin());
}

std::span<const CatalogueEntry> catalogue() { return entries(); }

std::optional<std::size_t> catalogue_index_of(std::string_view name) {
  static const auto by_name = [] {
    std::unordered_map<std::string_view, std::size_t> map;
    for (std::size_t i = 0; i < entries().size(); ++i) map.emplace(entries()[i].name, i);
    return map;
  }();
  const auto it = by_name.find(name);
  if (it == by_name.end()) return std::nullopt;
  return it->second;
}

}  // namespace ravencal::core
