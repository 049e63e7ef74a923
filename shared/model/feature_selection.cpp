// SPDX-License-Identifier: Apache-2.0
//
// The grammar of --features: terms select channels, and are applied from left to right.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <optional>

#include "core/catalogue.hpp"
#include "core/joint_layout.hpp"
#include "model/feature_spec.hpp"

namespace ravencal::model {
namespace {

using core::FeatureGroup;
using core::RavenField;
using record::Channel;
using record::Role;

/// Catalogue entry of a channel, if it is one of raven_state's.
const core::CatalogueEntry* entry_of(const Channel& channel) {
  const auto index = core::catalogue_index_of(channel.name);
  return index ? &core::catalogue()[*index] : nullptr;
}

/// Group of channels that no catalogue names, from their role.
std::optional<FeatureGroup> group_of(const Channel& channel) {
  if (const core::CatalogueEntry* entry = entry_of(channel)) return entry->group;
  switch (channel.role) {
    case Role::kJointEstimate:
    case Role::kDesiredPosition:
      return FeatureGroup::kJointPose;
    case Role::kMotorPosition:
      return FeatureGroup::kMotorPose;
    case Role::kMotorVelocity:
    case Role::kDesiredVelocity:
      return FeatureGroup::kVelocity;
    case Role::kDriveTorque:
      return FeatureGroup::kTorque;
    case Role::kDriveInput:
      return FeatureGroup::kCurrent;
    case Role::kStatus:
      return FeatureGroup::kTimeAndState;
    default:
      return std::nullopt;
  }
}

bool belongs_to_joint(const Channel& channel, std::string_view joint) {
  if (channel.joint == joint) return true;
  const core::CatalogueEntry* entry = entry_of(channel);
  return entry != nullptr && !entry->other_arm && entry->joint_slot < core::kSlotCount &&
         core::kSlotNames[entry->joint_slot] == joint;
}

/// Glob match with * only; linear in practice, names are short.
bool matches(std::string_view pattern, std::string_view name) {
  const std::size_t star = pattern.find('*');
  if (star == std::string_view::npos) return pattern == name;
  if (name.substr(0, star) != pattern.substr(0, star)) return false;
  const std::string_view rest = pattern.substr(star + 1);
  for (std::size_t i = star; i <= name.size(); ++i) {
    if (matches(rest, name.substr(i))) return true;
  }
  return false;
}

/// The light network's inputs: position (joint, motor, desired), velocity and torque of the three
/// calibrated joints. The stretch of the cable depends on them, and none of them counts from the
/// position at power-on, so that the network stays valid after another homing.
bool is_light(const core::CatalogueEntry& entry) {
  constexpr std::array kFields = {RavenField::kJpos, RavenField::kJposD, RavenField::kJvel,
                                  RavenField::kMpos, RavenField::kMposD, RavenField::kMvel,
                                  RavenField::kTau};
  return !entry.other_arm && entry.joint_slot < core::kCalibratedJointCount &&
         std::find(kFields.begin(), kFields.end(), entry.field) != kFields.end();
}

/// The inputs of light-open: measured joints and their play operators, and nothing that answers to
/// the motor command, so that no loop is closed through it. The plays remember from which side a
/// joint came, as friction and hysteresis of its cable do, which torque and velocity say in
/// `light`. Half-widths, chosen among four sets on one random motion of the digital twin (sinusoid,
/// seed 102), whose RMSE is therefore a little optimistic: some times the stretch of a cable.
std::vector<FeatureSpec> light_open() {
  struct Widths {
    std::string_view joint;
    std::array<float, 2> half_widths_ji;  // rad or m
  };
  constexpr std::array<Widths, core::kCalibratedJointCount> kJoints = {
      {{"shoulder", {0.01F, 0.03F}}, {"elbow", {0.01F, 0.03F}}, {"insertion", {0.001F, 0.003F}}}};
  std::vector<FeatureSpec> features;
  for (const Widths& joint : kJoints) features.push_back({fmt::format("jpos.{}", joint.joint)});
  for (const Widths& joint : kJoints) {
    for (const float half_width : joint.half_widths_ji) {
      features.push_back({fmt::format("jpos.{}", joint.joint), Transform::kPlay, 0, half_width});
    }
  }
  return features;
}

constexpr std::string_view kLightOpen = "light-open";

using EntryTest = bool (*)(const core::CatalogueEntry&);

EntryTest preset_from(std::string_view name) {
  if (name == "paper112") {
    return [](const core::CatalogueEntry& entry) { return entry.in_paper_table; };
  }
  if (name == "notebook208") {  // the authors' notebooks, feature_list
    return [](const core::CatalogueEntry& entry) {
      return entry.field != RavenField::kEncVals && entry.field != RavenField::kEncOffsets;
    };
  }
  if (name == "light") return is_light;
  return nullptr;
}

/// Up to eight of the names, for a message.
std::string some_of(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 8;
  const std::size_t shown = std::min(names.size(), kShown);
  const auto end = names.begin() + static_cast<std::ptrdiff_t>(shown);
  std::string text = fmt::format("{}", fmt::join(names.begin(), end, ", "));
  if (names.size() > shown) text += fmt::format(" and {} more", names.size() - shown);
  return text;
}

class Selector {
 public:
  explicit Selector(std::span<const Channel> available) {
    for (const Channel& channel : available) {
      if (!record::tells_truth(channel.role)) channels_.push_back(&channel);
    }
  }

  /// Whether there is the position of a mean over travel.
  [[nodiscard]] core::Status check_position(const FeatureSpec& feature) const {
    if (!is_travel_mean(feature.transform) || has(feature.along)) return {};
    return core::usage_error(fmt::format(
        "features: '{}' needs the position '{}', which is no channel that an input may use; the "
        "recording has {}",
        feature.text(), feature.along, some_of(where([](const Channel&) { return true; }))));
  }

  /// Names of the channels that a term (without @, ~ or %) selects.
  core::Result<std::vector<std::string>> select(std::string_view term) const {
    if (const EntryTest preset = preset_from(term)) return select_preset(term, preset);
    constexpr std::string_view kGroup = "group:";
    constexpr std::string_view kJoint = "joint:";
    std::vector<std::string> names;
    if (term.starts_with(kGroup)) {
      const auto group = core::feature_group_from(term.substr(kGroup.size()));
      if (!group)
        return core::usage_error(fmt::format("features: '{}' is no group; {}", term, groups()));
      names = where([&](const Channel& c) { return group_of(c) == group; });
    } else if (term.starts_with(kJoint)) {
      const std::string_view joint = term.substr(kJoint.size());
      names = where([&](const Channel& c) { return belongs_to_joint(c, joint); });
    } else {
      names = where([&](const Channel& c) { return matches(term, c.name); });
    }
    if (names.empty()) {
      return core::usage_error(fmt::format(
          "features: '{}' selects nothing; the recording has {}, and the built-in sets are "
          "paper112, notebook208, light and light-open",
          term, some_of(where([](const Channel&) { return true; }))));
    }
    return names;
  }

  /// The features of light-open; its channels must be there.
  core::Result<std::vector<FeatureSpec>> select_light_open() const {
    std::vector<FeatureSpec> features = light_open();
    std::vector<std::string> missing;
    for (const FeatureSpec& feature : features) {
      if (feature.transform == Transform::kValue && !has(feature.channel)) {
        missing.push_back(feature.channel);
      }
    }
    if (missing.empty()) return features;
    return lacks(kLightOpen, missing);
  }

  /// What an empty text means.
  std::vector<std::string> select_default() const {
    auto paper = select("paper112");
    if (paper.ok()) return std::move(paper).value();
    return where([](const Channel&) { return true; });
  }

 private:
  template <typename Test>
  std::vector<std::string> where(const Test& test) const {
    std::vector<std::string> names;
    for (const Channel* channel : channels_) {
      if (test(*channel)) names.push_back(channel->name);
    }
    return names;
  }

  core::Result<std::vector<std::string>> select_preset(std::string_view name,
                                                       EntryTest wanted) const {
    std::vector<std::string> names;
    std::vector<std::string> missing;
    for (const core::CatalogueEntry& entry : core::catalogue()) {
      if (!wanted(entry)) continue;
      (has(entry.name) ? names : missing).push_back(entry.name);
    }
    if (missing.empty()) return names;
    return lacks(name, missing);
  }

  [[nodiscard]] bool has(std::string_view name) const {
    return std::any_of(channels_.begin(), channels_.end(),
                       [&](const Channel* c) { return c->name == name; });
  }

  static core::Error lacks(std::string_view set, const std::vector<std::string>& missing) {
    return core::usage_error(
        fmt::format("features: the set '{}' needs {} channels that the recording lacks: {}", set,
                    missing.size(), some_of(missing)));
  }

  static std::string groups() {
    std::vector<std::string_view> names;
    for (std::size_t i = 0; i < core::kFeatureGroupCount; ++i) {
      names.push_back(core::name_of(static_cast<FeatureGroup>(i)));
    }
    return fmt::format("the groups are {}", fmt::join(names, ", "));
  }

  std::vector<const Channel*> channels_;
};

std::string_view trim(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

/// Applies one term to `features`.
core::Status apply(const Selector& selector, std::string_view term,
                   std::vector<FeatureSpec>& features) {
  const bool remove = term.starts_with('-');
  if (remove) term = trim(term.substr(1));
  if (term == kLightOpen) {
    RAVENCAL_ASSIGN_OR_RETURN(const std::vector<FeatureSpec> set, selector.select_light_open());
    for (const FeatureSpec& feature : set) {
      std::erase(features, feature);
      if (!remove) features.push_back(feature);
    }
    return {};
  }
  RAVENCAL_ASSIGN_OR_RETURN(const FeatureSpec pattern, FeatureSpec::parse(term));
  RAVENCAL_RETURN_IF_ERROR(selector.check_position(pattern));
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<std::string> names, selector.select(pattern.channel));
  for (const std::string& name : names) {
    FeatureSpec feature = pattern;
    feature.channel = name;
    if (remove) {
      std::erase_if(features, [&](const FeatureSpec& f) {
        return pattern.transform == Transform::kValue ? f.channel == name : f == feature;
      });
    } else if (std::find(features.begin(), features.end(), feature) == features.end()) {
      features.push_back(feature);
    }
  }
  return {};
}

}  // namespace

core::Result<std::vector<FeatureSpec>> select_features(std::string_view text,
                                                       std::span<const Channel> available) {
  const Selector selector(available);
  std::vector<FeatureSpec> features;
  std::string_view rest = trim(text);
  if (rest.empty() || rest.front() == '-') {
    for (std::string& name : selector.select_default()) features.push_back({std::move(name)});
  }
  while (!rest.empty()) {
    const std::size_t comma = rest.find(',');
    const std::string_view term = trim(rest.substr(0, comma));
    if (term.empty())
      return core::usage_error(fmt::format("features: '{}' has an empty term", text));
    RAVENCAL_RETURN_IF_ERROR(apply(selector, term, features));
    if (comma == std::string_view::npos) break;
    rest = rest.substr(comma + 1);
    if (trim(rest).empty())
      return core::usage_error(fmt::format("features: '{}' ends with a comma", text));
  }
  if (features.empty())
    return core::usage_error(fmt::format("features: '{}' leaves no feature", text));
  return features;
}

void add_play(std::vector<FeatureSpec>& features, std::span<const float> half_widths,
              std::span<const Channel> available) {
  const auto is_position = [&](const std::string& name) {
    const auto channel = std::find_if(available.begin(), available.end(),
                                      [&](const Channel& c) { return c.name == name; });
    if (channel == available.end()) return false;
    const auto group = group_of(*channel);
    return group == FeatureGroup::kJointPose || group == FeatureGroup::kMotorPose;
  };
  const std::vector<FeatureSpec> present = features;
  for (const float half_width : half_widths) {
    for (const FeatureSpec& feature : present) {
      if (feature.transform != Transform::kValue || !is_position(feature.channel)) continue;
      FeatureSpec play = feature;
      play.transform = Transform::kPlay;
      play.play_half_width = half_width;
      features.push_back(play);
    }
  }
}

}  // namespace ravencal::model
