// SPDX-License-Identifier: Apache-2.0
#include "diagnose/track/tracks.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "core/units.hpp"
#include "diagnose/track/filter.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using record::Recording;
using record::Role;

/// A signal that is nearer to the measured one than this share of it was copied from it. Source:
/// converters of drives have 12 bits or a little more and resolve a few thousandths of a usual
/// effort, so that nothing computed comes nearer to what they measured.
constexpr double kCopied = 1e-3;
/// Share of the motion's variance that a simulation may miss and still be compared row by row.
/// Source: a simulation is satisfactory from an efficiency (1 - this share) of 0.5 on (Moriasi et
/// al. 2007, Transactions of the ASABE 50, 885-900; the efficiency is Nash's and Sutcliffe's).
constexpr double kMostMotionMissed = 0.5;

enum class Compared { kEffort, kPosition, kTracking };

/// How a signal is called, and what a simulation lacks that does not have it.
struct ComparedWords {
  std::string_view stage, motion, per, lacking;
};

const ComparedWords& compared_words(Compared what) {
  static constexpr std::array<ComparedWords, 3> kWords = {{
      {"drive", "speed", "/s", "drive_torque or drive_input, or a position beside it"},
      {"transmission", "position", "",
       "joint_truth, or joint_estimate or motor_position beside it"},
      {"tracking", "position", "", "desired_position or joint_estimate"},
  }};
  return kWords[static_cast<std::size_t>(what)];
}

/// One recording or its simulation.
struct Side {
  Side(const Track& of, const physics::Plant& plant)
      : track(&of), predictor(plant, of.forced, physics::Masses::kFixed) {}

  /// What is compared of a joint; empty: not recorded.
  [[nodiscard]] VectorXd value(std::size_t j, Compared what) const {
    const JointTrack& joint = track->joints[j];
    if (what == Compared::kEffort) return joint.effort;
    if (joint.truth.size() == 0 || joint.tracking != (what == Compared::kTracking)) return {};
    const VectorXd& followed = track->forced.followed[j];
    return joint.truth - (followed.size() > 0 ? followed : predictor.believed()[j]);
  }

  /// What the value follows first: friction and inertia the speed, cables the position.
  [[nodiscard]] VectorXd motion(std::size_t j, Compared what) const {
    if (what == Compared::kEffort) return tent(track->forced.motors[j].v, track->tent_rows);
    return what == Compared::kTracking ? track->joints[j].truth : predictor.believed()[j];
  }

  const Track* track;
  physics::Predictor predictor;
};

struct Pair {
  Pair(Track& recorded, const Track& simulation, const physics::Plant& plant)
      : to_shift(&recorded), real(recorded, plant), simulated(simulation, plant) {
    real.predictor.move_links(real.predictor.predict(plant).hanging);
    by_plant = real.predictor.predict(plant);
  }

  Track* to_shift;
  Side real, simulated;
  physics::Prediction by_plant;
};

/// Over rows that both have, recordings one after the other.
struct Apart {
  bool recorded = false, simulated = false;
  Index rows = 0;
  double measured = 0.0, left = 0.0;  ///< deviation as recorded; RMS of that less the simulated
  double moved = 0.0, motion = 0.0;   ///< deviations of what it follows and of that difference

  [[nodiscard]] bool copied() const { return left <= kCopied * measured; }
  [[nodiscard]] bool same_motion() const { return motion <= kCopied * moved; }
  /// Of the motion's variance.
  [[nodiscard]] double missed() const { return moved > 0.0 ? std::pow(motion / moved, 2) : 0.0; }
};

double rms_of(const std::vector<double>& values, bool about_mean) {
  if (values.empty()) return 0.0;
  const Eigen::Map<const VectorXd> x(values.data(), static_cast<Index>(values.size()));
  return std::sqrt((x.array() - (about_mean ? x.mean() : 0.0)).square().mean());
}

Apart apart_in(const std::vector<Pair>& pairs, std::size_t j, Compared what) {
  Apart out;
  std::vector<double> measured, left, moved, motion;
  for (const Pair& p : pairs) {
    const VectorXd x = p.real.value(j, what);
    const VectorXd y = p.simulated.value(j, what);
    out.recorded = out.recorded || x.size() > 0;
    out.simulated = out.simulated || (x.size() > 0 && y.size() > 0);
    if (x.size() == 0 || y.size() == 0) continue;
    const VectorXd a = p.real.motion(j, what);
    const VectorXd b = p.simulated.motion(j, what);
    for (Index i = 0; i < x.size(); ++i) {
      const auto n = static_cast<std::size_t>(i);
      const bool lost = p.real.track->lost[j][n] != 0 || p.simulated.track->lost[j][n] != 0;
      if (lost || !std::isfinite(x[i] - y[i])) continue;
      left.push_back(x[i] - y[i]);
      measured.push_back(x[i]);
      moved.push_back(a[i]);
      motion.push_back(a[i] - b[i]);
    }
  }
  out.rows = static_cast<Index>(left.size());
  out.measured = rms_of(measured, true);
  out.left = rms_of(left, false);
  out.moved = rms_of(moved, true);
  out.motion = rms_of(motion, true);
  return out;
}

std::string motion_words(const physics::Joint& joint, Compared what, const Apart& apart) {
  const core::DisplayUnit unit =
      core::display_unit(joint.kind == physics::JointKind::kPrismatic ? "m" : "rad");
  const ComparedWords& words = compared_words(what);
  return fmt::format("{} differs by {:.3g} of {:.3g} {}{} RMS", words.motion,
                     apart.motion * unit.per_si, apart.moved * unit.per_si, unit.name, words.per);
}

/// Why the two cannot be compared; empty if they can.
std::string incomparable(const physics::Joint& joint, Compared what, const Apart& apart) {
  const bool drive = what == Compared::kEffort;
  if (!apart.simulated) return fmt::format("the simulation lacks {}", compared_words(what).lacking);
  if (apart.rows == 0) return "the simulation has no row in common with the recording";
  if (apart.copied()) {
    return fmt::format(
        "the simulation has the recorded {} ({:.2g} of it differs), so that nothing is left to "
        "compare; {}",
        drive ? "effort" : "error", apart.measured > 0.0 ? apart.left / apart.measured : 0.0,
        drive ? "to compare efforts, give an inverse simulation, which computes the effort of the "
                "recorded motion"
              : "give a simulation that computes the joint from the motor");
  }
  if (apart.missed() > kMostMotionMissed) {
    return fmt::format(
        "the simulation moves too differently to be compared row by row: its {}, {:.0f} % of the "
        "variance, and {:.0f} % is the most; give an inverse simulation, or start the simulation "
        "anew from the recorded state more often",
        motion_words(joint, what, apart), 100.0 * apart.missed(), 100.0 * kMostMotionMissed);
  }
  return {};
}

/// Compares signal by signal and says what cannot be compared.
class Comparison {
 public:
  Comparison(const physics::Plant& plant, Tracks& real, const Tracks& simulated) : plant_(plant) {
    for (std::vector<Track> Tracks::*list : {&Tracks::training, &Tracks::held_out})
      for (std::size_t t = 0; t < std::min((real.*list).size(), (simulated.*list).size()); ++t)
        pairs_.emplace_back((real.*list)[t], (simulated.*list)[t], plant);
  }

  /// True if that signal is left, recording minus simulation; else it is dropped.
  bool compare(std::size_t j, Compared what) {
    const Apart apart = apart_in(pairs_, j, what);
    if (!apart.recorded) return false;
    const physics::Joint& joint = plant_.joints[j];
    const std::string where = fmt::format("joint {} ({})", joint.name, compared_words(what).stage);
    const std::string why = incomparable(joint, what, apart);
    if (!why.empty())
      reasons.push_back(fmt::format("{} is not compared: {}", where, why));
    else if (!apart.same_motion())
      notes.push_back(
          fmt::format("{}: the simulation has a motion of its own (its {}), and what follows from "
                      "that counts as error",
                      where, motion_words(joint, what, apart)));
    if (what == Compared::kEffort && apart.simulated && apart.copied()) driven.insert(j);
    for (Pair& pair : pairs_) shift(pair, j, what, why.empty());
    return why.empty();
  }

  std::set<std::size_t> driven;  ///< joints that the recorded effort drives in the simulation
  std::vector<std::string> notes, reasons;

 private:
  static void shift(Pair& p, std::size_t j, Compared what, bool keep) {
    const bool drive = what == Compared::kEffort;
    JointTrack& joint = p.to_shift->joints[j];
    VectorXd& signal = drive ? joint.effort : joint.truth;
    const VectorXd simulated = p.simulated.value(j, what);
    if (!keep || simulated.size() == 0) {
      signal = {};
      return;
    }
    if (signal.size() == 0) return;
    VectorXd& off = drive ? joint.effort_shift : joint.truth_shift;
    off = drive ? VectorXd(simulated - p.by_plant.effort[j])
                : VectorXd(simulated + p.real.predictor.believed()[j] - p.by_plant.position[j]);
    signal -= off;
  }

  const physics::Plant& plant_;
  std::vector<Pair> pairs_;
};

/// What is left of these joints is their motion.
Recordings without_efforts(Recordings recordings, const std::set<std::string>& joints) {
  for (Recording& recording : recordings) {
    for (record::Channel& channel : recording.channels) {
      const bool effort = channel.role == Role::kDriveTorque || channel.role == Role::kDriveInput;
      if (effort && joints.contains(channel.joint)) channel.role = Role::kFeature;
    }
  }
  return recordings;
}

/// The simulations at the recordings' times: training, held out.
struct Simulated {
  Recordings training, held_out;
};

core::Result<Simulated> aligned_with(const Recordings& training, const Recordings& held_out,
                                     const Recordings& simulated, std::vector<std::string>& notes) {
  const std::vector<const Recording*> recordings = in_order(training, held_out);
  if (simulated.size() != recordings.size()) {
    return core::usage_error(
        fmt::format("--simulated: {} files for {} recordings; give one per recording, held-out "
                    "recordings last",
                    simulated.size(), recordings.size()));
  }
  notes = input_notes(simulated, {}, {});
  Simulated out;
  for (std::size_t i = 0; i < simulated.size(); ++i) {
    RAVENCAL_ASSIGN_OR_RETURN(Recording aligned, at_times_of(*recordings[i], simulated[i], notes));
    (i < training.size() ? out.training : out.held_out).push_back(std::move(aligned));
  }
  return out;
}

/// Takes that joint from other tracks of the same rows.
void take_joint(std::size_t j, const std::vector<Track>& from, std::vector<Track>& to) {
  for (std::size_t t = 0; t < std::min(from.size(), to.size()); ++t) {
    to[t].joints[j] = from[t].joints[j];
    to[t].forced.motors[j] = from[t].forced.motors[j];
    to[t].forced.followed[j] = from[t].forced.followed[j];
    to[t].lost[j] = from[t].lost[j];
  }
}

/// How joints that the recorded effort drives lag behind what was asked of them, in both; those
/// that can be compared take their place in `tracks`. True if there are any.
bool compare_lags(const core::Result<Tracks>& simulated, core::Result<Tracks> real,
                  const physics::Plant& plant, Comparison& comparison, Tracks& tracks) {
  // Without a desired position nothing is left, and the reasons stand.
  if (!real.ok() || !simulated.ok()) return false;
  Comparison lags(plant, *real, *simulated);
  bool any = false;
  for (const std::size_t j : comparison.driven) {
    if (!lags.compare(j, Compared::kTracking)) continue;
    any = true;
    take_joint(j, real->training, tracks.training);
    take_joint(j, real->held_out, tracks.held_out);
  }
  for (auto part : {&Comparison::notes, &Comparison::reasons})
    (comparison.*part).insert((comparison.*part).end(), (lags.*part).begin(), (lags.*part).end());
  return any;
}

}  // namespace

core::Status compare_with_simulation(const Recordings& simulated, const Recordings& training,
                                     const Recordings& held_out, const physics::Plant& plant,
                                     std::optional<double> held_out_from_s, Tracks& tracks) {
  std::vector<std::string> notes;
  RAVENCAL_ASSIGN_OR_RETURN(const Simulated other,
                            aligned_with(training, held_out, simulated, notes));
  RAVENCAL_ASSIGN_OR_RETURN(const Tracks baseline,
                            make_tracks(other.training, other.held_out, plant, held_out_from_s));
  Comparison comparison(plant, tracks, baseline);
  bool any = false;
  for (std::size_t j = 0; j < plant.joints.size(); ++j)
    for (const Compared what : {Compared::kEffort, Compared::kPosition, Compared::kTracking})
      any = comparison.compare(j, what) || any;
  // The law compares the recording with itself.
  for (std::vector<Track>* list : {&tracks.training, &tracks.held_out})
    for (Track& track : *list)
      for (JointTrack& joint : track.joints) joint.desired = {};
  if (!comparison.driven.empty()) {
    std::set<std::string> names;
    for (const std::size_t j : comparison.driven) names.insert(plant.joints[j].name);
    const auto moved = [&](const Recordings& seen, const Recordings& unseen) {
      return make_tracks(without_efforts(seen, names), without_efforts(unseen, names), plant,
                         held_out_from_s);
    };
    any = compare_lags(moved(other.training, other.held_out), moved(training, held_out), plant,
                       comparison, tracks) ||
          any;
  }
  if (!any) {
    return core::data_error(fmt::format("{}: nothing to compare with {}: {}",
                                        simulated.front().source, training.front().source,
                                        fmt::join(comparison.reasons, "; ")));
  }
  for (const std::vector<std::string>* part : {&notes, &comparison.notes, &comparison.reasons})
    tracks.notes.insert(tracks.notes.end(), part->begin(), part->end());
  return {};
}

}  // namespace ravencal::diagnose
