// SPDX-License-Identifier: Apache-2.0
#include "diagnose/series/input.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <set>

namespace ravencal::diagnose {
namespace {

using record::Channel;
using record::Recording;
using record::Role;

core::Status check_held_out_from(const Recordings& training, double from_s) {
  const auto longest = std::max_element(
      training.begin(), training.end(),
      [](const Recording& a, const Recording& b) { return recorded_s(a) < recorded_s(b); });
  const auto refuse = [&](std::string_view why) {
    return core::Error{
        core::ErrorCode::kUsage,
        fmt::format("--held-out-from {:g}: {}; {} ends at {:.6g} s: give a time between 0 and that",
                    from_s, why, longest->source, recorded_s(*longest))};
  };
  if (!(from_s <= recorded_s(*longest))) return refuse("no recording is that long");
  if (!(from_s > 0.0)) return refuse("leaves no row to fit");
  return {};
}

/// Units in which a drive's input may come; the first is the one that the plant asks for.
std::vector<std::string> input_units(const physics::Drive& drive) {
  // A share of full scale has no unit, whatever the drive turns it into.
  if (drive.dac_counts_per_n_m != 0.0) return {"dac_counts", "1"};
  if (drive.input == "voltage_v") return {"V", "1"};
  if (drive.input == "current_a") return {"A", "1"};
  if (drive.input == "force_n") return {"N", "N_m", "1"};
  return {"N_m", "N", "1"};
}

/// Units in which the plant can take that channel of the joint; empty: any.
std::vector<std::string> units_of(Role role, const physics::Joint& joint) {
  const bool revolute = joint.kind == physics::JointKind::kRevolute;
  switch (role) {
    case Role::kDesiredPosition:
    case Role::kJointEstimate:
    case Role::kJointTruth:
      return {revolute ? "rad" : "m"};
    case Role::kMotorPosition:
      return revolute ? std::vector<std::string>{"rad"} : std::vector<std::string>{"rad", "m"};
    case Role::kDriveTorque:
      return {"N_m", "N"};
    case Role::kDriveInput:
      return input_units(joint.drive);
    default:
      return {};
  }
}

core::Status check_units(const Recording& recording, const physics::Plant& plant) {
  for (const Channel& channel : recording.channels) {
    const auto index = plant.joint_index(channel.joint);
    if (!index) continue;
    const physics::Joint& joint = plant.joints[*index];
    // Where the drive's effort was recorded, nobody asks what its input was.
    const bool unused =
        channel.role == Role::kDriveInput && recording.column(Role::kDriveTorque, joint.name);
    const std::vector<std::string> fit = units_of(channel.role, joint);
    if (unused || fit.empty() || std::find(fit.begin(), fit.end(), channel.unit) != fit.end())
      continue;
    const bool input = channel.role == Role::kDriveInput;
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("{}: channel {} ({} of joint '{}') is in {}, but the plant {} takes {}; "
                    "correct the channel's unit or the plant's {}",
                    recording.source, channel.name, record::name_of(channel.role), joint.name,
                    channel.unit, plant.source, fmt::join(fit, " or "),
                    input ? "[joint.drive]" : "kind")};
  }
  return {};
}

/// A load that the plant names is part of every effort: without it nothing can be predicted.
core::Status check_external_loads(const Recording& recording, const physics::Plant& plant) {
  for (const physics::Joint& joint : plant.joints) {
    if (!joint.external_load || recording.column(joint.external_load->channel)) continue;
    std::vector<std::string> loads;
    for (const Channel& channel : recording.channels)
      if (channel.role == Role::kLoad) loads.push_back(channel.name);
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("{}: has no channel '{}', the [joint.external_load] of joint '{}' in {}; "
                    "recorded loads: {}",
                    recording.source, joint.external_load->channel, joint.name, plant.source,
                    loads.empty() ? "none" : fmt::format("{}", fmt::join(loads, ", ")))};
  }
  return {};
}

std::string meta_or_empty(const Recording& recording, const std::string& key) {
  const auto it = recording.meta.find(key);
  return it == recording.meta.end() ? "" : it->second;
}

/// Signals that tell of the joint in another recording and not in this one.
std::string missing_signals(const Recording& recording, const std::vector<const Recording*>& all,
                            const std::string& joint) {
  constexpr std::array kSignals = {Role::kJointEstimate,   Role::kJointTruth,  Role::kMotorPosition,
                                   Role::kDesiredPosition, Role::kDriveTorque, Role::kDriveInput};
  std::vector<std::string_view> names;
  for (const Role role : kSignals) {
    const bool elsewhere = std::any_of(all.begin(), all.end(), [&](const Recording* other) {
      return other->column(role, joint).has_value();
    });
    if (elsewhere && !recording.column(role, joint)) names.push_back(record::name_of(role));
  }
  if (names.empty()) return "its values are lost there or the drive was off";
  return fmt::format("it lacks {}", fmt::join(names, ", "));
}

/// Recordings without a valid row of the series, and held-out rows of which none is valid.
void add_silent_recordings(const Series& series, const std::vector<const Recording*>& all,
                           std::vector<std::string>& notes) {
  std::vector<std::size_t> rows(all.size(), 0);
  std::size_t unseen = 0;
  for (Eigen::Index i = 0; i < series.rows(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    if (series.valid[n] == 0) continue;
    ++rows[static_cast<std::size_t>(series.recording[n])];
    unseen += series.held_out[n] != 0 ? 1U : 0U;
  }
  const std::string where = fmt::format("joint {} ({})", series.joint, stage_word(series.stage));
  for (std::size_t r = 0; r < all.size(); ++r) {
    if (rows[r] == 0)
      notes.push_back(fmt::format("{} says nothing of {}: {}", file_name(*all[r]), where,
                                  missing_signals(*all[r], all, series.joint)));
  }
  if (series.any_held_out() && unseen == 0)
    notes.push_back(
        fmt::format("no held-out row shows {}, so that no figure stands for it", where));
}

/// Loads and joints that effects of the plant follow, where nobody recorded them.
void add_missing_sources(const Series& series, const physics::Joint& joint,
                         std::vector<std::string>& notes) {
  if (series.stage != Stage::kTransmission && series.stage != Stage::kTracking) return;
  std::vector<std::string> recorded = {series.joint};
  for (const auto* list : {&series.others, &series.loads})
    for (const Companion& companion : *list) recorded.push_back(companion.name);
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

std::vector<const Recording*> in_order(const Recordings& training, const Recordings& held_out) {
  std::vector<const Recording*> all;
  for (const Recordings* list : {&training, &held_out})
    for (const Recording& recording : *list) all.push_back(&recording);
  return all;
}

}  // namespace

std::string file_name(const Recording& recording) {
  return std::filesystem::path(recording.source).filename().string();
}

double recorded_s(const Recording& recording) {
  if (recording.t_ns.empty()) return 0.0;
  return 1e-9 * static_cast<double>(recording.t_ns.back() - recording.t_ns.front());
}

core::Status check_input(const Recordings& training, const Recordings& held_out,
                         const physics::Plant& plant, const SeriesOptions& options) {
  if (options.held_out_from_s)
    RAVENCAL_RETURN_IF_ERROR(check_held_out_from(training, *options.held_out_from_s));
  for (const Recording* recording : in_order(training, held_out)) {
    RAVENCAL_RETURN_IF_ERROR(check_units(*recording, plant));
    RAVENCAL_RETURN_IF_ERROR(check_external_loads(*recording, plant));
  }
  return {};
}

std::vector<std::string> input_notes(const Recordings& training, const Recordings& held_out,
                                     const SeriesOptions& options) {
  std::vector<std::string> notes;
  for (const Recording* recording : in_order(training, held_out)) {
    const std::string period_s = meta_or_empty(*recording, "assumed_row_period_s");
    if (!period_s.empty())
      notes.push_back(fmt::format(
          "{} has no time in each row, so that its rows count as {} s apart (the profile's "
          "time = \"COLUMN\" or row_period_s says how far they are)",
          file_name(*recording), period_s));
    const std::string dropped = meta_or_empty(*recording, "dropped_rows");
    if (!dropped.empty())
      notes.push_back(fmt::format("{} rows of {} cannot be read and are left out", dropped,
                                  file_name(*recording)));
  }
  if (!options.held_out_from_s) return notes;
  for (const Recording& recording : training) {
    if (recorded_s(recording) < *options.held_out_from_s)
      notes.push_back(
          fmt::format("{} ends at {:.6g} s, before --held-out-from {:g}: all of it is "
                      "fitted",
                      file_name(recording), recorded_s(recording), *options.held_out_from_s));
  }
  return notes;
}

std::vector<std::string> series_notes(const SeriesSet& set, const Recordings& training,
                                      const Recordings& held_out, const physics::Plant& plant) {
  const std::vector<const Recording*> all = in_order(training, held_out);
  std::vector<std::string> notes;
  for (const Series& series : set.series) {
    add_silent_recordings(series, all, notes);
    if (const auto index = plant.joint_index(series.joint))
      add_missing_sources(series, plant.joints[*index], notes);
  }
  return notes;
}

std::string recorded_joints(const Recordings& training) {
  std::map<std::string, std::set<std::string_view>> roles;
  for (const Recording& recording : training) {
    for (const Channel& channel : recording.channels)
      if (!channel.joint.empty()) roles[channel.joint].insert(record::name_of(channel.role));
  }
  if (roles.empty()) return "nothing of any joint";
  std::vector<std::string> words;
  for (const auto& [joint, of_joint] : roles)
    words.push_back(fmt::format("{} ({})", joint, fmt::join(of_joint, ", ")));
  return fmt::format("{}", fmt::join(words, ", "));
}

}  // namespace ravencal::diagnose
