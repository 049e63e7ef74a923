// SPDX-License-Identifier: Apache-2.0
//
// The catalogue of everything that raven_state says, once for both arms: 240 values, of which the
// paper (arXiv 2302.04999) names 112 per arm. Order = columns 12..251 of the authors' training CSV,
// with "this arm" (the calibrated one) in place of the first and "other" in place of the second.
// Used by the built-in profiles (which column is which), by the features (what a network sees), by
// the simulator (what it writes) and by the plugin (which field of the controller's state is
// which). Real-time code uses the constexpr part only (kRavenFields, catalogue_index); catalogue()
// owns strings and is for everything else.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace ravencal::core {

/// Ablation groups, those of the paper's Table II: its joint poses are kJointPose and kMotorPose,
/// its torque is kTorque and kCurrent. Its re-homing study found that the last three break the
/// calibration.
enum class FeatureGroup : std::uint8_t {
  kTimeAndState,     ///< time, run level, sub level, last_seq, board type, grasp_d
  kJointPose,        ///< jpos, jpos_d
  kMotorPose,        ///< mpos, mpos_d
  kEndEffectorPose,  ///< pos, ori, pos_d, ori_d
  kVelocity,         ///< mvel, jvel
  kTorque,           ///< tau
  kCurrent,          ///< dac_val (commanded current)
  kJacobian,         ///< jac_vel, jac_f
  kEncoderValue,     ///< encVals
  kEncoderOffset,    ///< encoffsets
  kVoid,             ///< every value of the unconnected slot 3
};
inline constexpr std::size_t kFeatureGroupCount = 11;

/// Name used on the command line and in files, e.g. "joint_pose".
std::string_view name_of(FeatureGroup group);
std::optional<FeatureGroup> feature_group_from(std::string_view name);

inline constexpr std::size_t kCatalogueSize = 240;
inline constexpr std::size_t kNoJoint = 8;

/// raven_state fields, in catalogue order.
enum class RavenField : std::uint8_t {
  kTime,
  kJpos,
  kRunlevel,
  kSublevel,
  kLastSeq,
  kType,
  kPos,
  kOri,
  kOriD,
  kPosD,
  kEncVals,
  kDac,
  kTau,
  kMpos,
  kMvel,
  kJvel,
  kMposD,
  kJposD,
  kGraspD,
  kEncOffsets,
  kJacVel,
  kJacF,
};
inline constexpr std::size_t kRavenFieldCount = 22;

/// Shape of one field: `count` values per arm, or once if not `per_arm`.
struct RavenFieldInfo {
  std::string_view name;          ///< channel prefix, e.g. "jpos"
  std::string_view message_unit;  ///< unit as published (units.hpp), e.g. "deg"
  std::size_t first;              ///< catalogue index of this arm's first value
  std::size_t count;              ///< values per arm
  bool per_arm;
  bool per_joint;  ///< count == 8, one per joint slot
};

/// One row per RavenField. `first` is the column of the authors' 252-column CSV minus 12.
inline constexpr std::array<RavenFieldInfo, kRavenFieldCount> kRavenFields = {{
    {"time", "s", 0, 1, false, false},         {"jpos", "deg", 1, 8, true, true},
    {"runlevel", "1", 17, 1, false, false},    {"sublevel", "1", 18, 1, false, false},
    {"last_seq", "1", 19, 1, false, false},    {"type", "1", 20, 1, true, false},
    {"pos", "um", 22, 3, true, false},         {"ori", "1", 28, 9, true, false},
    {"ori_d", "1", 46, 9, true, false},        {"pos_d", "um", 64, 3, true, false},
    {"enc", "counts", 70, 8, true, true},      {"dac", "dac_counts", 86, 8, true, true},
    {"tau", "N_m", 102, 8, true, true},        {"mpos", "deg", 118, 8, true, true},
    {"mvel", "deg_per_s", 134, 8, true, true}, {"jvel", "deg_per_s", 150, 8, true, true},
    {"mpos_d", "deg", 166, 8, true, true},     {"jpos_d", "deg", 182, 8, true, true},
    {"grasp_d", "rad", 198, 1, true, false},   {"enc_offset", "counts", 200, 8, true, true},
    {"jac_vel", "1", 216, 6, true, false},     {"jac_f", "1", 228, 6, true, false},
}};

constexpr const RavenFieldInfo& info_of(RavenField field) {
  return kRavenFields[static_cast<std::size_t>(field)];
}

/// What the RAVEN-II controller computes after the plugin's hook: there it is still that of the
/// cycle before (the DAC values are zero until the plugin's latch gives them back).
constexpr bool is_cycle_old_at_hook(RavenField field) {
  switch (field) {
    case RavenField::kPos:
    case RavenField::kOri:
    case RavenField::kPosD:
    case RavenField::kOriD:
    case RavenField::kDac:
    case RavenField::kTau:
    case RavenField::kMposD:
    case RavenField::kJposD:
    case RavenField::kGraspD:
    case RavenField::kJacVel:
    case RavenField::kJacF:
      return true;
    default:
      return false;
  }
}

/// Catalogue index of element `element` of `field`; `other_arm` selects the second arm.
constexpr std::size_t catalogue_index(RavenField field, std::size_t element,
                                      bool other_arm = false) {
  const RavenFieldInfo& info = info_of(field);
  return info.first + element + (other_arm && info.per_arm ? info.count : 0);
}

struct CatalogueEntry {
  std::string name;  ///< channel name: "jpos.elbow", "other.tau.wrist", "runlevel", "pos.x"
  RavenField field = RavenField::kTime;
  FeatureGroup group = FeatureGroup::kTimeAndState;
  std::size_t element = 0;            ///< position within the field
  std::size_t joint_slot = kNoJoint;  ///< JointSlot as number, or kNoJoint
  bool other_arm = false;
  std::string message_unit;  ///< as published; insertion positions are metres x 180/pi
  std::string si_unit;
  bool in_paper_table = false;  ///< one of the paper's 112 features of this arm
};

/// All entries; index = catalogue index. Built at the first call, never changed.
std::span<const CatalogueEntry> catalogue();

/// Entry of that channel name, if any.
std::optional<std::size_t> catalogue_index_of(std::string_view name);

}  // namespace ravencal::core
