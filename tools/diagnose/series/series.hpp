// SPDX-License-Identifier: Apache-2.0
//
// One residual channel of one joint: what was measured against what the plant's motion says, with
// the exogenous signals that may explain the difference. Built from recordings with whatever roles
// they have. SI units; efforts are referred to the joint.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "physics/cable_replay.hpp"
#include "physics/plant.hpp"
#include "physics/predict/smoother.hpp"
#include "physics/servo_law.hpp"
#include "record/recording.hpp"

namespace ravencal::diagnose {

using physics::CableMotion;
using physics::CableNumbers;
using physics::Motion;

/// Where a mismatch enters.
enum class Stage {
  kCommand,       ///< recorded drive command against the plant's control law
  kDrive,         ///< drive effort against the effort that the motion needs
  kTransmission,  ///< external joint position against the one derived from the motor or command
  kTracking,      ///< measured against desired position, where nothing else was recorded
};

/// Word of the report's schema. Tracking is reported as "drive": it is the drive that lags.
std::string_view stage_word(Stage stage);

/// A position of another joint, or a recorded load.
struct Companion {
  std::string name;
  std::string unit;
  Eigen::VectorXd value;
};

/// What another joint's error may add to this one through the plant's coupling. How much of it
/// arrives is the mechanism's matter: cables wound on the other joint's pulley follow its drive,
/// those that wrap its link follow the link itself, stretch included.
struct Inherited {
  std::string from;
  std::optional<physics::Through> through;  ///< what this joint's cable follows; empty: unknown
  double factor = 0.0;                      ///< of the coupling
  Eigen::VectorXd stretch;  ///< coupling times minus the other's cable stretch; zero mean
  Eigen::VectorXd rest;     ///< coupling times what else parts its truth from its estimate
  double offset = 0.0;      ///< mean of both together before it was removed
};

/// Effort that another joint's cable puts on this one, and this one's cable has to hold, if it
/// runs over this joint's link: coupling times its tension.
struct Carried {
  std::string from;
  Eigen::VectorXd weight, payload_per_kg;  ///< parts of that joint's; empty: it has none
  Eigen::VectorXd moving;                  ///< accelerations and friction behind that cable
};

struct Series {
  std::string joint;
  Stage stage = Stage::kTransmission;
  std::string unit;  ///< of the residual: rad, m, N_m or N
  bool prismatic = false;

  Eigen::VectorXd t_s;         ///< since the recording's start
  std::vector<int> recording;  ///< index of the recording of each row
  /// Each recording has a constant and a wander of its own, of which no other one tells.
  bool each_homed = false;
  /// The plant draws a constant at each homing: no constant is an error of the plant.
  bool homing_draws = false;
  std::vector<char> fresh;     ///< 1 where a recording or an episode starts
  std::vector<char> held_out;  ///< 1 for rows that no fit may see
  std::vector<char> valid;     ///< 0 where something needed was lost
  std::vector<char> at_rest;   ///< drive stage: 1 where friction may be anything; not fitted
  Eigen::VectorXd y;           ///< the residual before any nominal term
  Eigen::VectorXd recorded;    ///< drive stage: the effort before it was filtered like the motion
  /// `y` and `recorded` as they were measured, where another simulation has taken the plant's place
  /// in both. Empty: they are.
  Eigen::VectorXd measured_y, measured_recorded;

  Motion motion;                     ///< of this joint: motor side, or desired (tracking)
  std::vector<Companion> others;     ///< positions of the other joints, same side
  std::vector<Companion> loads;      ///< recorded loads that act on this joint
  std::vector<Inherited> inherited;  ///< transmission stage
  std::vector<Carried> carried;      ///< transmission stage: of cables that may run either way
  /// Where positions are compared: the motion with what other joints' cables add to it. Empty:
  /// nothing.
  Eigen::VectorXd followed;
  /// Tracking stage: position of the drive at the joint, the motion without what the plant's
  /// coupling adds to it. Elsewhere empty.
  Eigen::VectorXd driven;
  Eigen::VectorXd weight;      ///< effort that holds the plant's links; empty: plant has none
  Eigen::VectorXd found_load;  ///< part of `weight` that the drive's channel found
  double constant_load = 0.0;  ///< transmission stage: constant that the drive's fit found
  double free_offset = 0.0;    ///< drive stage, after the fit: constant effort that it found
  /// Relative deviation of `weight` where the drive's own channel measured it; else the plant's
  /// tolerance holds.
  std::optional<double> weight_deviation;
  std::optional<physics::ServoLaw> servo;  ///< the plant's; none without a controller
  double removable_mass_kg = 0.0;  ///< of the last link and its payload: no more can be missing
  double nominal_mass_kg = 0.0;    ///< of this joint's link, that `weight` was computed with
  double drive_order = 0.0;        ///< rad that the gearbox's shaft turns per unit of position
  double inertia = 0.0;            ///< nominal, at the joint: kg m^2 or kg
  double presliding = 0.0;         ///< the plant's, of the drive's friction; 0: it has none
  /// Effort that passes through the cable as far as the plant knows it: weight, the link's own
  /// acceleration and friction behind the cable. Empty where the plant has none of them.
  Eigen::VectorXd transmitted;
  /// Drive stage: position that winds the cable, what other joints add to the motor's included, and
  /// effort that friction behind other joints' cables asks of this motor. Empty: the motor's own;
  /// none.
  Eigen::VectorXd wound, others_friction;
  bool effort_recorded = false;    ///< of this joint: its drive says what it carries
  Eigen::VectorXd payload_per_kg;  ///< effort of a kilogram where the plant hangs its payload
  /// Drive stage: a payload that the joints weighed together, and what the motor feels of it, the
  /// friction behind the cable included; empty if none.
  double payload_kg = 0.0;
  Eigen::VectorXd payload_effort;
  Eigen::VectorXd tracking_error;  ///< desired minus believed position, where recorded
  /// Accelerations as an effort, and friction that cables over this joint's link pass on.
  Eigen::VectorXd inertial;
  CableNumbers cable;  ///< the plant's

  /// Command stage only: what the control law sees.
  Eigen::VectorXd position_error;
  Eigen::VectorXd measured_rate;  ///< raw difference or recorded, as a controller sees it
  Eigen::VectorXd desired_rate;

  [[nodiscard]] Eigen::Index rows() const { return y.size(); }
  /// Fills `valid`; lost values of `y` become zero, lost loads the value before them.
  void mark_valid();
  /// The cable as this series moves and loads it.
  [[nodiscard]] CableMotion cable_motion() const;
  /// What loops of the joint's own follow: friction and gaps are where the joint is, whoever moves
  /// it.
  [[nodiscard]] const Eigen::VectorXd& loop_motion() const {
    return followed.size() > 0 ? followed : motion.q;
  }
  /// What friction of the drive follows: a drive turns to make up for other joints as well.
  [[nodiscard]] const Eigen::VectorXd& drive_motion() const {
    return driven.size() > 0 ? driven : motion.q;
  }
  /// True for rows that fits see.
  [[nodiscard]] bool trains(Eigen::Index row) const;
  [[nodiscard]] bool any_held_out() const;
  /// A column through the filter of this stage's residual.
  [[nodiscard]] Eigen::VectorXd as_seen(const Eigen::VectorXd& column) const;
  /// Width below which a change of position is noise: for the direction of motion.
  [[nodiscard]] double rest_width() const;
  /// Displacement over which the drive's dry friction turns after a reversal: the plant's, or the
  /// least that can be seen.
  [[nodiscard]] double friction_displacement() const;
  /// Usual time between two rows of one stretch, from the first ones; 0 if there are none.
  [[nodiscard]] double row_period_s() const;
  /// Root mean square over valid training rows.
  [[nodiscard]] double training_rms(const Eigen::VectorXd& x) const;
  [[nodiscard]] double training_mean(const Eigen::VectorXd& x) const;
  /// [least, greatest] over valid training rows.
  [[nodiscard]] std::pair<double, double> training_range(const Eigen::VectorXd& x) const;
};

struct SeriesOptions {
  Eigen::Index most_rows = 60000;         ///< rows beyond are thinned by averaging residuals
  std::optional<double> held_out_from_s;  ///< rows from here on (of each recording) are held out
};

/// All channels that these recordings allow, in the plant's order of joints, with the reasons for
/// those they do not allow. `held_out` recordings may be empty. Errors: `held_out_from_s` that
/// holds nothing out or leaves nothing to fit (kUsage); too few samples, units that do not fit the
/// plant, or no joint with two signals to compare (kData).
struct SeriesSet {
  std::vector<Series> series;
  std::map<std::string, std::string> not_possible;  ///< joint -> why a stage could not be looked at
  /// What was taken for granted or left out, for whoever reads the report; no full stop.
  std::vector<std::string> notes;
};
core::Result<SeriesSet> build_series(const std::vector<record::Recording>& training,
                                     const std::vector<record::Recording>& held_out,
                                     const physics::Plant& plant, const SeriesOptions& options);

}  // namespace ravencal::diagnose
