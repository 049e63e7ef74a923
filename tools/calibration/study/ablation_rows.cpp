// SPDX-License-Identifier: Apache-2.0
#include "study/ablation_rows.hpp"

#include <fmt/format.h>

namespace ravencal::study {
namespace {

constexpr std::size_t kGroupedSets = 8;

Variant spoilt(Noise noise, const FeatureSet& set) {
  return {variant_id(noise, set.id), noise, set.terms};
}

/// The encoder's features of the re-homing study.
const FeatureSet& encoder_set() {
  static const FeatureSet set = {std::string(kNoEncoder),
                                 "encoder values, offsets, void motor pose",
                                 {"group:encoder_value", "group:encoder_offset", "mpos.void"}};
  return set;
}

}  // namespace

std::span<const FeatureSet> ablated_sets() {
  static const std::vector<FeatureSet> sets = {
      {"time_and_state", "time and state", {"group:time_and_state"}},
      {"joint_pose", "joint poses", {"group:joint_pose"}},
      {"motor_pose", "motor poses", {"group:motor_pose"}},
      {"end_effector_pose", "end-effector pose", {"group:end_effector_pose"}},
      {"velocity", "velocities", {"group:velocity"}},
      {"torque", "torques", {"group:torque"}},
      {"current", "currents", {"group:current"}},
      {std::string(kAllPoses),
       "all poses",
       {"group:joint_pose", "group:motor_pose", "group:end_effector_pose"}},
      {std::string(kMotorSidePoses),
       "joint and motor poses",
       {"group:joint_pose", "group:motor_pose"}},
      {"torque_and_current", "torques and currents", {"group:torque", "group:current"}},
      {"joint_1", "joint 1", {"joint:shoulder"}},
      {"joint_2", "joint 2", {"joint:elbow"}},
      {"joint_3", "joint 3", {"joint:insertion"}},
      {"joint_4", "joint 4 (tool roll)", {"joint:roll"}},
      {"joint_5", "joint 5 (wrist)", {"joint:wrist"}},
      {"joint_6", "joint 6 (jaw)", {"joint:grasp1"}},
      {"joint_7", "joint 7 (jaw)", {"joint:grasp2"}}};
  return sets;
}

std::span<const FeatureSet> grouped_sets() { return ablated_sets().first(kGroupedSets); }

std::span<const FeatureSet> homing_sets() {
  static const std::vector<FeatureSet> sets = {
      {"no_encoder_value", "all but encoder values", {"group:encoder_value"}},
      {"no_encoder_offset", "all but encoder offsets", {"group:encoder_offset"}},
      {"no_void", "all but the void motor pose", {"mpos.void"}},
      {std::string(kNoEncoder), "no encoder: all three left out", encoder_set().terms}};
  return sets;
}

std::span<const FeatureSet> torque_sets() {
  static const std::vector<FeatureSet> sets = {
      {"tau", "torques", {"tau.*"}},
      {"dac", "currents", {"dac.*"}},
      {"tau_and_dac", "torques and currents", {"tau.*", "dac.*"}}};
  return sets;
}

std::string_view name_of(Noise noise) {
  switch (noise) {
    case Noise::kDeviation:
      return "std";
    case Noise::kMean:
      return "mean";
    case Noise::kRange:
      return "range";
    case Noise::kZero:
      return "zero";
    case Noise::kFlip:
      return "flip";
    case Noise::kTriple:
      return "triple";
    case Noise::kNone:
      break;
  }
  return "none";
}

std::string_view title_of(Noise noise) {
  switch (noise) {
    case Noise::kDeviation:
      return "± one standard deviation";
    case Noise::kMean:
      return "± the mean's magnitude";
    case Noise::kRange:
      return "+ least to greatest";
    case Noise::kZero:
      return "set to zero";
    case Noise::kFlip:
      return "× −1";
    case Noise::kTriple:
      return "× 3";
    case Noise::kNone:
      break;
  }
  return "as it is";
}

std::string_view name_of(TestSet set) {
  switch (set) {
    case TestSet::kFull:
      return "full";
    case TestSet::kEncoder:
      return "encoder";
    case TestSet::kPlain:
      break;
  }
  return "plain";
}

std::string variant_id(Noise noise, std::string_view set) {
  return fmt::format("{}:{}", name_of(noise), set);
}

std::vector<Variant> variants_of(TestSet set) {
  std::vector<Variant> variants = {{std::string(kNoAblation), Noise::kNone, {}}};
  if (set == TestSet::kEncoder) variants.push_back(spoilt(Noise::kDeviation, encoder_set()));
  if (set != TestSet::kFull) return variants;
  for (const FeatureSet& ablated : ablated_sets()) {
    variants.push_back(spoilt(Noise::kDeviation, ablated));
  }
  for (const FeatureSet& grouped : grouped_sets()) {
    for (const Noise noise : kOtherNoises) variants.push_back(spoilt(noise, grouped));
  }
  for (const FeatureSet& torque : torque_sets()) {
    for (const Noise noise : kTorqueNoises) variants.push_back(spoilt(noise, torque));
  }
  return variants;
}

}  // namespace ravencal::study
