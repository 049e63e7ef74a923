// SPDX-License-Identifier: Apache-2.0
#include "diagnose/track/tracks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <string_view>
#include <utility>

namespace ravencal::diagnose {
namespace {

using record::Recording;

constexpr double kNoEnd = std::numeric_limits<double>::infinity();

/// Rows of these recordings between two times. `place`: of the first recording.
core::Status add_tracks(const Recordings& recordings, std::size_t place,
                        const physics::Plant& plant, std::pair<double, double> between_s,
                        std::vector<Track>& tracks, std::vector<std::string>& notes) {
  const bool late = between_s.first > 0.0;
  std::optional<core::Error> too_few;
  const std::size_t before = tracks.size();
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    if (recorded_s(recordings[r]) < between_s.first) continue;
    auto track = make_track(recordings[r], plant, between_s.first, between_s.second);
    if (!track.ok()) {
      too_few = track.error();
      notes.push_back(fmt::format("{}{} has too few rows to be looked at",
                                  late ? "the held-out part of " : "", file_name(recordings[r])));
      continue;
    }
    track->recording = place + r;
    if (track->at_rest)
      notes.push_back(fmt::format(
          "{}{} was taken as {} rests, approached from either side: no speed and no acceleration "
          "shows in it",
          late ? "the held-out part of " : "", file_name(recordings[r]), track->rows()));
    tracks.push_back(std::move(*track));
  }
  if (tracks.size() == before && too_few) return *too_few;
  return {};
}

/// A position is compared with the command only where no recording shows more of its joint.
void agree_on_tracking(Tracks& tracks, std::size_t joint) {
  const auto shows_more = [&](const Track& track) {
    const JointTrack& j = track.joints[joint];
    return !j.tracking && (j.truth.size() > 0 || j.effort.size() > 0);
  };
  const auto any = [&](const std::vector<Track>& list) {
    return std::any_of(list.begin(), list.end(), shows_more);
  };
  if (!any(tracks.training) && !any(tracks.held_out)) return;
  for (std::vector<Track>* list : {&tracks.training, &tracks.held_out}) {
    for (Track& track : *list) {
      JointTrack& j = track.joints[joint];
      if (j.tracking) j.truth = track.forced.followed[joint] = {};
      j.tracking = false;
    }
  }
}

bool compares_anything(const std::vector<Track>& tracks) {
  return std::any_of(tracks.begin(), tracks.end(), [](const Track& track) {
    return std::any_of(track.joints.begin(), track.joints.end(), [](const JointTrack& joint) {
      return joint.truth.size() > 0 || joint.effort.size() > 0;
    });
  });
}

}  // namespace

core::Result<Tracks> make_tracks(const Recordings& training, const Recordings& held_out,
                                 const physics::Plant& plant,
                                 std::optional<double> held_out_from_s) {
  RAVENCAL_RETURN_IF_ERROR(check_input(training, held_out, plant, held_out_from_s));
  Tracks out;
  out.notes = input_notes(training, held_out, held_out_from_s);
  const double split_s = held_out_from_s.value_or(kNoEnd);
  RAVENCAL_RETURN_IF_ERROR(add_tracks(training, 0, plant, {0.0, split_s}, out.training, out.notes));
  if (held_out_from_s)
    RAVENCAL_RETURN_IF_ERROR(
        add_tracks(training, 0, plant, {split_s, kNoEnd}, out.held_out, out.notes));
  RAVENCAL_RETURN_IF_ERROR(
      add_tracks(held_out, training.size(), plant, {0.0, kNoEnd}, out.held_out, out.notes));
  for (std::size_t j = 0; j < plant.joints.size(); ++j) agree_on_tracking(out, j);
  if (compares_anything(out.training)) return out;
  const std::string& source = training.front().source;
  return core::data_error(
      fmt::format("{}: no joint of the plant {} has two signals to compare: joint_truth with "
                  "joint_estimate or motor_position, drive_torque or drive_input with a position, "
                  "or desired_position with a measured one; recorded: {} (`ravencal info {}` lists "
                  "all)",
                  source, plant.source, recorded_joints(training), source));
}

}  // namespace ravencal::diagnose
