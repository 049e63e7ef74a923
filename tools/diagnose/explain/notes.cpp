// SPDX-License-Identifier: Apache-2.0
#include "diagnose/explain/notes.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "diagnose/explain/view.hpp"
#include "diagnose/findings/policy.hpp"

namespace ravencal::diagnose {
namespace {

using record::Recording;
using record::Role;
using All = std::vector<const Recording*>;

constexpr std::array kOfJoint = {Role::kJointEstimate,   Role::kJointTruth,  Role::kMotorPosition,
                                 Role::kDesiredPosition, Role::kDriveTorque, Role::kDriveInput};
constexpr std::array kPositions = {Role::kJointEstimate, Role::kJointTruth, Role::kMotorPosition,
                                   Role::kDesiredPosition};

/// Signals that tell of the joint in another recording and not in this one.
std::string what_it_lacks(const Recording& recording, const All& all, const std::string& joint) {
  std::vector<std::string_view> names;
  for (const Role role : kOfJoint) {
    const bool elsewhere = std::any_of(all.begin(), all.end(), [&](const Recording* other) {
      return other->column(role, joint).has_value();
    });
    if (elsewhere && !recording.column(role, joint)) names.push_back(record::name_of(role));
  }
  if (names.empty()) return "its values are lost there, the drive was off or the joint at rest";
  return fmt::format("it lacks {}", fmt::join(names, ", "));
}

const Channel* same_in(const Likelihood& likelihood, const Channel& channel) {
  for (const Channel& other : likelihood.channels())
    if (other.joint == channel.joint && other.kind == channel.kind) return &other;
  return nullptr;
}

/// Recordings without a used row of the channel, and held-out rows of which none is used.
void add_silent(const Likelihood& fitted, const Likelihood* shown, const Channel& channel,
                const All& all, const std::string& joint, std::vector<std::string>& notes) {
  const std::string where = fmt::format("joint {} ({})", joint, stage_of(channel));
  std::vector<std::size_t> rows(all.size(), 0);
  std::vector<char> looked(all.size(), 0);
  std::size_t unseen = 0;
  for (const Likelihood* likelihood : {&fitted, shown}) {
    const Channel* same = likelihood != nullptr ? same_in(*likelihood, channel) : nullptr;
    if (same == nullptr) continue;
    for (std::size_t r = 0; r < same->used.size(); ++r) {
      const std::size_t place = likelihood->tracks()[r].recording;
      looked[place] = 1;
      rows[place] += same->used[r].size();
      if (likelihood == shown) unseen += same->used[r].size();
    }
  }
  for (std::size_t r = 0; r < all.size(); ++r) {
    if (looked[r] != 0 && rows[r] == 0)
      notes.push_back(fmt::format("{} says nothing of {}: {}", file_name(*all[r]), where,
                                  what_it_lacks(*all[r], all, joint)));
  }
  if (shown != nullptr && unseen == 0)
    notes.push_back(
        fmt::format("no held-out row shows {}, so that no figure stands for it", where));
}

/// Loads and joints that effects of the plant follow, where nobody recorded them.
void add_missing_sources(const Likelihood& fitted, const All& all, const physics::Plant& plant,
                         const physics::Joint& joint, std::vector<std::string>& notes) {
  std::vector<std::string> recorded;
  for (const physics::Joint& other : plant.joints) {
    const bool known = std::any_of(all.begin(), all.end(), [&](const Recording* recording) {
      return std::any_of(kPositions.begin(), kPositions.end(), [&](Role role) {
        return recording->column(role, other.name).has_value();
      });
    });
    if (known) recorded.push_back(other.name);
  }
  for (const Track& track : fitted.tracks()) {
    for (const RecordedLoad& load : track.loads)
      if (std::find(recorded.begin(), recorded.end(), load.name) == recorded.end())
        recorded.push_back(load.name);
  }
  for (const physics::Effect& effect : joint.effects) {
    for (const std::string& name : {effect.from, effect.posture}) {
      if (name.empty() || std::find(recorded.begin(), recorded.end(), name) != recorded.end())
        continue;
      notes.push_back(fmt::format(
          "the plant's {} of joint {} follows '{}', which was not recorded, so that it is not "
          "predicted in full (recorded: {})",
          effect.id, joint.name, name, fmt::join(recorded, ", ")));
    }
  }
}

}  // namespace

std::vector<std::string> channel_notes(const Likelihood& fitted, const Likelihood* shown,
                                       const Recordings& training, const Recordings& held_out,
                                       const physics::Plant& plant) {
  All all;
  for (const Recordings* list : {&training, &held_out})
    for (const Recording& recording : *list) all.push_back(&recording);
  std::vector<std::string> notes;
  for (const Channel& channel : fitted.channels()) {
    const physics::Joint& joint = plant.joints[channel.joint];
    add_silent(fitted, shown, channel, all, joint.name, notes);
    if (channel.kind == ChannelKind::kPosition)
      add_missing_sources(fitted, all, plant, joint, notes);
  }
  return notes;
}

std::vector<std::string> routing_notes(const std::vector<Routing>& routings) {
  std::vector<std::string> notes;
  for (const Routing& r : routings) {
    if (r.by_plant) continue;
    const bool decided = std::max(r.link, r.drive) >= kCredible;
    notes.push_back(
        decided
            ? fmt::format("joint {}'s cable was taken to follow the {}s of the joints that move "
                          "it, {:.1f} % likely by these recordings; the plant does not say",
                          r.joint, r.through, 100.0 * std::max(r.link, r.drive))
            : fmt::format("the plant does not say whether joint {}'s cable follows the links or "
                          "the drives of the joints that move it, and these recordings do not "
                          "tell (links {:.0f} %, drives {:.0f} %)",
                          r.joint, 100.0 * r.link, 100.0 * r.drive));
  }
  return notes;
}

}  // namespace ravencal::diagnose
