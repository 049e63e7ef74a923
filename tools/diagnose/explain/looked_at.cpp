// SPDX-License-Identifier: Apache-2.0
//
// What of the recordings could be compared with the plant, and why the rest could not.
#include "diagnose/explain/parts.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "diagnose/explain/circumstances.hpp"
#include "diagnose/explain/view.hpp"
#include "diagnose/findings/words.hpp"
#include "physics/plant_effort.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using record::Recording;
using record::Role;
using All = std::vector<const Recording*>;

constexpr std::array kSignalsOfJoint = {Role::kJointEstimate, Role::kJointTruth,
                                        Role::kMotorPosition, Role::kDesiredPosition,
                                        Role::kDriveTorque,   Role::kDriveInput};
constexpr std::array kPositions = {Role::kJointEstimate, Role::kJointTruth, Role::kMotorPosition,
                                   Role::kDesiredPosition};

/// A tent over +-h passes half of the power at this number over h: sinc(0.319)^4 = 1/2.
constexpr double kHalfPower = 0.319;

double longest_stretch_s(const std::vector<Track>& tracks) {
  double longest_s = 0.0;
  for (const Track& track : tracks) {
    double begin_s = 0.0;
    for (Index i = 0; i < track.rows(); ++i) {
      if (track.forced.fresh[static_cast<std::size_t>(i)] != 0) begin_s = track.forced.t_s[i];
      longest_s = std::max(longest_s, track.forced.t_s[i] - begin_s);
    }
  }
  return longest_s;
}

/// Of one period in the longest stretch, and where the filter or half the row rate ends it.
Interval band_of(const Likelihood& fitted) {
  const double longest_s = longest_stretch_s(fitted.tracks());
  if (!(longest_s > 0.0)) return {0.0, 0.0};
  double highest_hz = 0.0;
  for (const Track& track : fitted.tracks()) {
    const double half_width_s = static_cast<double>(track.tent_rows) * track.period_s;
    const double filter_hz =
        track.tent_rows > 1 ? kHalfPower / half_width_s : std::numeric_limits<double>::infinity();
    highest_hz = std::max(highest_hz, std::min(0.5 / track.period_s, filter_hz));
  }
  return {1.0 / longest_s, highest_hz};
}

/// Share of the power of the effort that the filter does not pass.
double above_band(const Channel& channel, const std::vector<Track>& tracks) {
  double recorded = 0.0, passed = 0.0;
  for (std::size_t r = 0; r < tracks.size(); ++r) {
    const double power = tracks[r].joints[channel.joint].effort_power;
    if (channel.kind != ChannelKind::kDrive || !(power > 0.0)) continue;
    const Eigen::ArrayXd seen = channel.measured[r].array();
    const auto rows = static_cast<double>(seen.size());
    recorded += power * rows;
    passed += std::min(power * rows, (seen - seen.mean()).square().sum());
  }
  return recorded > 0.0 ? 1.0 - passed / recorded : 0.0;
}

/// The channel with all recorded rows, those at rest as well.
Channel with_rest(const Channel& channel, const std::vector<Track>& tracks) {
  Channel out = channel;
  for (std::size_t r = 0; r < tracks.size(); ++r) {
    out.used[r].clear();
    if (channel.measured[r].size() == 0) continue;
    const std::vector<char>& lost = tracks[r].lost[channel.joint];
    for (Index i = 0; i < tracks[r].rows(); ++i)
      if (lost[static_cast<std::size_t>(i)] == 0) out.used[r].push_back(i);
  }
  return out;
}

Interval range_of(const Channel& channel, const Circumstance& circumstance) {
  const Eigen::VectorXd values = used_rows(channel, circumstance.value);
  return {values.minCoeff(), values.maxCoeff()};
}

void add_motion(const Channel& channel, const Likelihood& fitted, const physics::Plant& given,
                LookedAt& out) {
  const Circumstances circumstances = circumstances_of(channel, fitted, given);
  const Channel all = with_rest(channel, fitted.tracks());
  if (used_row_count(all) == 0) return;
  for (const Circumstance& c : circumstances.own) {
    if (c.name == "position") {
      out.position = range_of(all, c);
    } else if (c.name == "velocity") {
      const Eigen::ArrayXd speed = used_rows(all, c.value).array().abs();
      out.fastest = speed.maxCoeff();
      out.rest_share =
          (speed < kRestOfUsualSpeed * std::sqrt(speed.square().mean())).cast<double>().mean();
    } else if (c.name == "load" && channel.kind != ChannelKind::kLaw) {
      out.load = range_of(all, c);
    }
  }
  // A command is compared with its law as a whole.
  if (channel.kind == ChannelKind::kLaw) return;
  for (const auto* list : {&circumstances.own, &circumstances.others})
    for (const Circumstance& c : *list) out.circumstances.push_back(c.name);
}

LookedAt looked_at(const Channel& channel, const Channel* held_out, const Likelihood& fitted,
                   const physics::Plant& given) {
  const physics::Joint& joint = given.joints[channel.joint];
  LookedAt out;
  out.joint = joint.name;
  out.stage = stage_of(channel);
  out.held_out_rows = held_out != nullptr ? used_row_count(*held_out) : 0;
  out.rows = used_row_count(channel) + out.held_out_rows;
  out.band_hz = band_of(fitted);
  out.above_band = above_band(channel, fitted.tracks());
  out.position_unit = position_unit_of(joint);
  out.effort_unit = effort_unit_of(joint);
  add_motion(channel, fitted, given, out);
  return out;
}

const Channel* same_channel(const Channel& channel, const Likelihood* others) {
  return others != nullptr ? others->find(channel.joint, channel.kind) : nullptr;
}

/// Signals that tell of the joint in another recording and not in this one.
std::string what_it_lacks(const Recording& recording, const All& all, const std::string& joint) {
  std::vector<std::string_view> names;
  for (const Role role : kSignalsOfJoint) {
    const bool elsewhere = std::any_of(all.begin(), all.end(), [&](const Recording* other) {
      return other->column(role, joint).has_value();
    });
    if (elsewhere && !recording.column(role, joint)) names.push_back(record::name_of(role));
  }
  if (names.empty()) return "its values are lost there, the drive was off or the joint at rest";
  return fmt::format("it lacks {}", fmt::join(names, ", "));
}

/// Recordings without a used row of the channel, and held-out rows of which none is used.
void add_silent(const Likelihood& fitted, const Likelihood* shown, const Channel& channel,
                const All& all, const std::string& joint, std::vector<std::string>& notes) {
  const std::string where = fmt::format("joint {} ({})", joint, stage_of(channel));
  std::vector<std::size_t> rows(all.size(), 0);
  std::vector<char> looked(all.size(), 0);
  for (const Likelihood* likelihood : {&fitted, shown}) {
    const Channel* same = same_channel(channel, likelihood);
    if (same == nullptr) continue;
    for (std::size_t r = 0; r < same->used.size(); ++r) {
      const std::size_t place = likelihood->tracks()[r].recording;
      looked[place] = 1;
      rows[place] += same->used[r].size();
    }
  }
  for (std::size_t r = 0; r < all.size(); ++r) {
    if (looked[r] != 0 && rows[r] == 0)
      notes.push_back(fmt::format("{} says nothing of {}: {}", file_name(*all[r]), where,
                                  what_it_lacks(*all[r], all, joint)));
  }
  const Channel* held_out = same_channel(channel, shown);
  if (shown != nullptr && (held_out == nullptr || used_row_count(*held_out) == 0))
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
          words_of(effect.id), joint.name, name, fmt::join(recorded, ", ")));
    }
  }
}

/// Joints of the plant that were not recorded, beside recorded ones that it does not have: mostly
/// two names of one.
void add_strangers(const All& all, const physics::Plant& plant, std::vector<std::string>& notes) {
  std::vector<std::string> strangers, unrecorded;
  for (const Recording* recording : all)
    for (const record::Channel& channel : recording->channels)
      if (!channel.joint.empty() && !plant.joint_index(channel.joint))
        add_once(strangers, channel.joint);
  for (const physics::Joint& joint : plant.joints) {
    const bool recorded = std::any_of(all.begin(), all.end(), [&](const Recording* recording) {
      return std::any_of(recording->channels.begin(), recording->channels.end(),
                         [&](const record::Channel& c) { return c.joint == joint.name; });
    });
    if (!recorded) unrecorded.push_back(joint.name);
  }
  if (strangers.empty() || unrecorded.empty()) return;
  notes.push_back(fmt::format(
      "the plant has no joint {}, which the recordings have and which was not looked at, and they "
      "have no {}: give them one name in the profile or in the plant",
      fmt::join(strangers, ", "), fmt::join(unrecorded, ", ")));
}

}  // namespace

void add_channel_notes(const Likelihood& fitted, const Likelihood* held_out,
                       const std::vector<const Recording*>& all, const physics::Plant& plant,
                       std::vector<std::string>& notes) {
  add_strangers(all, plant, notes);
  for (const std::string& note : plant.notes) notes.push_back("of the robot model: " + note);
  if (physics::lacks_geometry(plant))
    notes.emplace_back(
        "the plant's links have masses, and nothing says where its joints are, so that weight and "
        "inertia of the arm are not predicted: state a [joint.frame] for each joint");
  for (const Channel& channel : fitted.channels()) {
    const physics::Joint& joint = plant.joints[channel.joint];
    add_silent(fitted, held_out, channel, all, joint.name, notes);
    if (channel.kind == ChannelKind::kPosition)
      add_missing_sources(fitted, all, plant, joint, notes);
  }
}

std::string why_not(const Likelihood& fitted, std::size_t joint, std::string_view stage) {
  const bool drive = shown(fitted, joint, "drive");
  const bool position = shown(fitted, joint, "transmission");
  if (stage == "command")
    return "the recording or the plant lacks the command's inputs, its output or its control law";
  if (!drive && !position)
    return "the recording holds too few of this joint's positions and efforts";
  if (stage == "drive" ? drive : position) return "no row of its signals can be compared";
  return stage == "drive"
             ? "no drive effort was recorded, so friction and load of the drive cannot be seen"
             : "no joint_truth was recorded, so nothing behind the motor can be seen";
}

void add_looked_at(const Likelihood& fitted, const Likelihood* held_out,
                   const physics::Plant& given, Report& report) {
  for (const Channel& channel : fitted.channels())
    if (used_row_count(channel) > 0)
      report.looked_at.push_back(
          looked_at(channel, same_channel(channel, held_out), fitted, given));
  constexpr std::array<std::string_view, 3> kStages = {"command", "drive", "transmission"};
  for (std::size_t j = 0; j < given.joints.size(); ++j) {
    const std::string& name = given.joints[j].name;
    for (const std::string_view stage : kStages) {
      NotLookedAt out{name, std::string(stage), {}};
      if (at_place_of(out, report.looked_at)) continue;
      out.because = why_not(fitted, j, stage);
      report.not_looked_at.push_back(std::move(out));
    }
  }
}

}  // namespace ravencal::diagnose
