// SPDX-License-Identifier: Apache-2.0
#include "diagnose/series/input.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

namespace ravencal::diagnose {
namespace {

using record::Recording;
using record::Role;

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

std::vector<const Recording*> series_order(const Recordings& training, const Recordings& held_out) {
  std::vector<const Recording*> all;
  for (const Recordings* list : {&training, &held_out})
    for (const Recording& recording : *list) all.push_back(&recording);
  return all;
}

}  // namespace

std::vector<std::string> series_notes(const SeriesSet& set, const Recordings& training,
                                      const Recordings& held_out, const physics::Plant& plant) {
  const std::vector<const Recording*> all = series_order(training, held_out);
  std::vector<std::string> notes;
  for (const Series& series : set.series) {
    add_silent_recordings(series, all, notes);
    if (const auto index = plant.joint_index(series.joint))
      add_missing_sources(series, plant.joints[*index], notes);
  }
  return notes;
}

}  // namespace ravencal::diagnose
