// SPDX-License-Identifier: Apache-2.0
#include "study/ablation_rows.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace ravencal::study {
namespace {

Variant spoilt(Noise noise, const FeatureSet& set) {
  return {variant_id(noise, set.id), noise, set.terms, NoiseInto::kInputs};
}

/// The encoder's features of the re-homing study.
const FeatureSet& encoder_set() {
  static const FeatureSet set = {std::string(kNoEncoder),
                                 "encoder values, offsets, void motor pose",
                                 {"group:encoder_value", "group:encoder_offset", "mpos.void"}};
  return set;
}

const FeatureSet& set_of(std::string_view id) {
  const auto sets = ablated_sets();
  return *std::find_if(sets.begin(), sets.end(), [&](const FeatureSet& s) { return s.id == id; });
}

/// Sets of paper_sets() with the believed angle of joint 1 or 2. That of joint 3 is a copy in the
/// notebooks, converted to metres.
bool has_believed_angles(std::string_view set) {
  return set == kJointPoses || set == kAllPoses || set == joint_set(1) || set == joint_set(2);
}

void add_paper(std::vector<Variant>& variants) {
  for (const FeatureSet& set : paper_sets()) {
    variants.push_back(spoilt(Noise::kDeviation, set));
    if (has_believed_angles(set.id)) {
      variants.push_back(
          {released_id(set.id), Noise::kDeviation, set.terms, NoiseInto::kBelievedAsWell});
    }
  }
  for (const Noise noise : {Noise::kFlip, Noise::kTriple}) {
    variants.push_back(spoilt(noise, set_of(kTorques)));
  }
}

void add_further(std::vector<Variant>& variants) {
  for (const FeatureSet& set : ablated_sets().subspan(paper_sets().size())) {
    variants.push_back(spoilt(Noise::kDeviation, set));
  }
  for (const FeatureSet& grouped : grouped_sets()) {
    for (const Noise noise : kOtherNoises) {
      if (grouped.id == kTorques && noise == Noise::kFlip) continue;  // add_paper() has it
      variants.push_back(spoilt(noise, grouped));
    }
  }
  for (const FeatureSet& torque : torque_sets()) {
    if (torque.id == kTorques) continue;
    for (const Noise noise : {Noise::kFlip, Noise::kTriple}) {
      variants.push_back(spoilt(noise, torque));
    }
  }
}

}  // namespace

std::span<const FeatureSet> ablated_sets() {
  static const std::vector<FeatureSet> sets = {
      {std::string(kOperatingStatus), "operating status", {"group:time_and_state"}},
      {std::string(kJointPoses),
       "joint poses (joint, motor)",
       {"group:joint_pose", "group:motor_pose"}},
      {std::string(kEndEffector), "end-effector", {"group:end_effector_pose"}},
      {std::string(kAllPoses),
       "all poses",
       {"group:joint_pose", "group:motor_pose", "group:end_effector_pose"}},
      {std::string(kTorques), "torque (torque, current)", {"group:torque", "group:current"}},
      {"velocity", "velocity", {"group:velocity"}},
      {"jacobian", "Jacobian", {"group:jacobian"}},
      {joint_set(1), "joint 1", {"joint:shoulder"}},
      {joint_set(2), "joint 2", {"joint:elbow"}},
      {joint_set(3), "joint 3", {"joint:insertion"}},
      {"joint_pose", "joint poses alone", {"group:joint_pose"}},
      {"motor_pose", "motor poses alone", {"group:motor_pose"}},
      {"torque", "torques alone", {"group:torque"}},
      {"current", "currents alone", {"group:current"}},
      {joint_set(4), "joint 4 (tool roll)", {"joint:roll"}},
      {joint_set(5), "joint 5 (wrist)", {"joint:wrist"}},
      {joint_set(6), "joint 6 (jaw)", {"joint:grasp1"}},
      {joint_set(7), "joint 7 (jaw)", {"joint:grasp2"}}};
  return sets;
}

std::span<const FeatureSet> paper_sets() {
  constexpr std::size_t kPaperSets = 10;
  return ablated_sets().first(kPaperSets);
}

std::span<const FeatureSet> grouped_sets() {
  const auto sets = paper_sets();
  return {sets.begin(), std::find_if(sets.begin(), sets.end(), is_joint_set)};
}

std::span<const FeatureSet> homing_sets() {
  static const std::vector<FeatureSet> sets = {
      {"no_encoder_value", "all but encoder values", {"group:encoder_value"}},
      {"no_encoder_offset", "all but encoder offsets", {"group:encoder_offset"}},
      {"no_void", "all but the void motor pose", {"mpos.void"}},
      {std::string(kNoEncoder), "no encoder", encoder_set().terms}};
  return sets;
}

const FeatureSet& other_poses() { return set_of(kAllPoses); }

std::span<const FeatureSet> torque_sets() {
  static const std::vector<FeatureSet> sets = {set_of(kTorques), set_of("torque"),
                                               set_of("current")};
  return sets;
}

std::string joint_set(int joint) { return fmt::format("joint_{}", joint); }

bool is_joint_set(const FeatureSet& set) {
  return set.id.size() == 7 && set.id.starts_with("joint_");
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
      return "± half the mean's magnitude";
    case Noise::kRange:
      return "± half the range";
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

std::string_view name_of(NoiseFrom rows) { return rows == NoiseFrom::kTest ? "test" : "training"; }

std::optional<NoiseFrom> noise_from_name(std::string_view name) {
  for (const NoiseFrom rows : {NoiseFrom::kTest, NoiseFrom::kTraining}) {
    if (name_of(rows) == name) return rows;
  }
  return std::nullopt;
}

std::string_view name_of(TestSet set) {
  switch (set) {
    case TestSet::kPaper:
      return "paper";
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

std::string released_id(std::string_view set) {
  return has_believed_angles(set) ? fmt::format("released:{}", set)
                                  : variant_id(Noise::kDeviation, set);
}

std::vector<Variant> variants_of(TestSet set) {
  std::vector<Variant> variants = {{std::string(kNoAblation), Noise::kNone, {}, {}}};
  if (set == TestSet::kEncoder) variants.push_back(spoilt(Noise::kDeviation, encoder_set()));
  if (set == TestSet::kPaper || set == TestSet::kFull) add_paper(variants);
  if (set == TestSet::kFull) add_further(variants);
  return variants;
}

}  // namespace ravencal::study
