// SPDX-License-Identifier: Apache-2.0
//
// How far off each drive ends up on its own: in windows of several lengths under the recorded
// effort, and over whole stretches under the plant's controller. All plants run with the numbers
// that they state; nothing is fitted.
#include "diagnose/explain/parts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "physics/drives.hpp"
#include "physics/plant_effort.hpp"
#include "physics/predict/run_drive.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kWindowS = 1.0;
constexpr double kHorizonsS[] = {0.5, kWindowS, 2.0, 5.0};
/// A window ends where rows are missing; what is left counts from this share of its length on.
constexpr double kLeastWindow = 0.9;
/// A shorter stretch shows hardly more than where it started.
constexpr double kLeastStretchS = 0.5;
/// A run that left for good counts as so far off (rad or m), not as infinity.
constexpr double kFarOff = 1e3;
/// Where the plant does not say over which displacement friction builds up: deviations of the
/// position's noise, and share of its range below which a direction says nothing about a robot.
constexpr double kBristleDeviations = 6.0;
constexpr double kBristleShareOfRange = 5e-4;

struct RowsToRun {
  Index first, last;
};

/// Rows on which the drive can run, end to end, each window within one episode and at most
/// `longest_s` long.
std::vector<RowsToRun> rows_to_run(const Track& track, std::size_t joint, const VectorXd& driven_by,
                                   double least_s, double longest_s) {
  const VectorXd& t_s = track.forced.t_s;
  const auto usable = [&](Index i) {
    return track.lost[joint][static_cast<std::size_t>(i)] == 0 && std::isfinite(driven_by[i]);
  };
  std::vector<RowsToRun> out;
  for (Index first = 0, last = 0; first < track.rows(); first = std::max(last, first + 1)) {
    last = first;
    while (last < track.rows() && usable(last) && t_s[last] - t_s[first] < longest_s &&
           (last == first || track.forced.fresh[static_cast<std::size_t>(last)] == 0))
      ++last;
    if (last > first + 1 && t_s[last - 1] - t_s[first] >= least_s) out.push_back({first, last});
  }
  return out;
}

/// Central differences; where an episode starts the slope of the parabola through its first rows.
VectorXd velocity_of(const Track& track, const VectorXd& position) {
  VectorXd velocity = VectorXd::Zero(position.size());
  const auto episode_starts = [&](Index i) {
    return i <= 0 || i >= track.rows() || track.forced.fresh[static_cast<std::size_t>(i)] != 0;
  };
  for (Index i = 0; i < position.size(); ++i) {
    const bool before = !episode_starts(i);
    const bool after = !episode_starts(i + 1);
    if (before && after)
      velocity[i] = (position[i + 1] - position[i - 1]) / (2.0 * track.period_s);
    else if (after && !episode_starts(i + 2))
      velocity[i] =
          (4.0 * position[i + 1] - 3.0 * position[i] - position[i + 2]) / (2.0 * track.period_s);
  }
  return velocity;
}

/// DriveState::bristle along the recorded motion.
VectorXd bristle_along(const Track& track, const VectorXd& position, double presliding) {
  VectorXd bristle = VectorXd::Zero(position.size());
  for (Index i = 1; i < position.size(); ++i) {
    if (track.forced.fresh[static_cast<std::size_t>(i)] != 0) continue;
    const double moved = (position[i] - position[i - 1]) / presliding;
    bristle[i] = (bristle[i - 1] + moved) / (1.0 + std::abs(moved));
  }
  return bristle;
}

/// One joint of one plant along the recordings of the view.
class PlantDrive {
 public:
  PlantDrive(const physics::Plant& plant, const Likelihood& rows, std::size_t joint)
      : plant_(plant), rows_(rows), joint_(joint) {
    const physics::Joint& of = plant.joints[joint];
    drive_.effort_limit = of.parameter("saturation", "limit");
    for (std::size_t r = 0; r < rows.tracks().size(); ++r) {
      const Track& track = rows.tracks()[r];
      const physics::Motion& motor = track.forced.motors[joint];
      const double range = motor.q.maxCoeff() - motor.q.minCoeff();
      least_presliding_ = std::max(
          {least_presliding_, kBristleDeviations * motor.noise, kBristleShareOfRange * range});
    }
    drive_.numbers = physics::drive_numbers(of, physics::joint_inertia(plant, joint),
                                            std::max(least_presliding_, 1e-12));
  }

  /// Sums over rows after the first of each window.
  struct Errors {
    double squares = 0.0, magnitudes = 0.0, rows = 0.0;

    void add(double error) {
      const double bounded = std::isfinite(error) ? std::min(std::abs(error), kFarOff) : kFarOff;
      squares += bounded * bounded;
      magnitudes += bounded;
      rows += 1.0;
    }
    [[nodiscard]] double rms() const { return std::sqrt(squares / rows); }
    [[nodiscard]] double mean() const { return magnitudes / rows; }
  };

  [[nodiscard]] Errors under_effort(double window_s) { return errors({}, window_s); }

  [[nodiscard]] Errors under(const physics::ServoLaw& law) {
    return errors(law, std::numeric_limits<double>::infinity());
  }

 private:
  Errors errors(const std::optional<physics::ServoLaw>& law, double window_s) {
    drive_.law = law;
    Errors out;
    for (std::size_t r = 0; r < rows_.tracks().size(); ++r) {
      const Track& track = rows_.tracks()[r];
      const JointTrack& recorded = track.joints[joint_];
      const VectorXd& driven_by = law ? recorded.desired : recorded.effort;
      if (driven_by.size() == 0) continue;
      const double least_s = law ? kLeastStretchS : kLeastWindow * window_s;
      const std::vector<RowsToRun> windows =
          rows_to_run(track, joint_, driven_by, least_s, window_s);
      if (!windows.empty()) run(r, windows, out);
    }
    return out;
  }

  void run(std::size_t r, const std::vector<RowsToRun>& windows, Errors& out) {
    const Track& track = rows_.tracks()[r];
    const VectorXd& position = track.forced.motors[joint_].q;
    physics::DriveSignals signals{track.forced.t_s,
                                  position,
                                  velocity_of(track, position),
                                  bristle_along(track, position, drive_.numbers.presliding),
                                  track.joints[joint_].effort,
                                  track.joints[joint_].desired,
                                  {}};
    drive_.load = load_along(r, signals.bristle);
    const VectorXd none = VectorXd::Zero(position.size());
    physics::DriveRun ran{none, none, none};
    for (const RowsToRun& window : windows) {
      const Index end = physics::run_drive(drive_, signals, window.first, window.last, ran);
      for (Index i = window.first + 1; i < window.last; ++i)
        out.add(i < end ? ran.position[i] - position[i] : kFarOff);
    }
  }

  /// What all cables ask of the motor, but the inertia and the friction that the drive has itself.
  [[nodiscard]] physics::DriveLoad load_along(std::size_t r, const VectorXd& side) const {
    if (auto pendulum = physics::pendulum_load(plant_)) return *pendulum;
    physics::Plant others = plant_;
    set_plant_number(others, joint_, "joint_friction", "level", 0.0);
    const Track& track = rows_.tracks()[r];
    physics::DriveLoad load{asked_of_motor(r, others)};
    // While other joints move it, a joint does not turn with its motor, nor does its friction.
    if (physics::coupled(plant_, joint_) && track.joints[joint_].effort.size() > 0)
      load.recorded = asked_of_motor(r, plant_) -
                      plant_.joints[joint_].parameter("joint_friction", "level") * side;
    const double inertia = physics::link_inertia(plant_.joints[joint_]);
    load.recorded -= inertia * track.forced.motors[joint_].a;
    return load;
  }

  [[nodiscard]] VectorXd asked_of_motor(std::size_t r, const physics::Plant& plant) const {
    const physics::Prediction prediction = rows_.predictor(r).predict(plant);
    const Eigen::MatrixXd of_motor = physics::drive_kinematics(plant).of_motor;
    VectorXd asked = VectorXd::Zero(rows_.tracks()[r].rows());
    for (std::size_t k = 0; k < plant.joints.size(); ++k)
      asked += of_motor(static_cast<Index>(k), static_cast<Index>(joint_)) * prediction.tension[k];
    return asked;
  }

  const physics::Plant& plant_;
  const Likelihood& rows_;
  std::size_t joint_;
  double least_presliding_ = 0.0;
  physics::RunningDrive drive_;
};

/// No plant states whether its controller's damping knows of the desired velocity: the recorded
/// effort says which of the two it is.
bool damps_velocity_error(const physics::ServoLaw& law, const Likelihood& rows, std::size_t joint) {
  double with = 0.0, without = 0.0;
  for (const Track& track : rows.tracks()) {
    const JointTrack& recorded = track.joints[joint];
    if (recorded.desired.size() == 0 || recorded.effort.size() == 0) continue;
    const VectorXd& position = track.forced.motors[joint].q;
    const VectorXd velocity = velocity_of(track, position);
    const VectorXd desired_velocity = velocity_of(track, recorded.desired);
    for (Index i = 0; i < track.rows(); ++i) {
      const double left =
          recorded.effort[i] - law.effort(recorded.desired[i] - position[i], velocity[i]);
      const double known = law.rate * desired_velocity[i];
      if (!std::isfinite(left + known) || track.lost[joint][static_cast<std::size_t>(i)] != 0)
        continue;
      without += left * left;
      with += (left - known) * (left - known);
    }
  }
  return with < without;
}

std::optional<physics::ServoLaw> law_of(const physics::Plant& plant, const Likelihood& rows,
                                        std::size_t joint) {
  auto law = physics::servo_law(plant.joints[joint]);
  if (!law || law->position <= 0.0) return std::nullopt;
  if (damps_velocity_error(*law, rows, joint)) law->desired_rate = law->rate;
  return law;
}

double position_noise(const Likelihood& rows, std::size_t joint) {
  double squares = 0.0;
  for (const Track& track : rows.tracks()) squares += std::pow(track.forced.motors[joint].noise, 2);
  return std::sqrt(squares / static_cast<double>(rows.tracks().size()));
}

}  // namespace

void add_free_run(const View& view, const physics::Plant& refitted, Report& report) {
  const Likelihood& rows = view.rows;
  for (std::size_t j = 0; j < view.given.joints.size(); ++j) {
    const physics::Joint& joint = view.given.joints[j];
    const bool driven =
        std::any_of(rows.tracks().begin(), rows.tracks().end(),
                    [j](const Track& track) { return track.joints[j].effort.size() > 0; });
    if (!driven) continue;
    const auto add = [&](const char* metric, double before, double after) {
      report.held_out.push_back(
          {joint.name, metric, position_unit_of(joint), before, after, position_noise(rows, j)});
    };
    PlantDrive given(view.given, rows, j);
    PlantDrive improved(view.improved, rows, j);
    PlantDrive with_own_numbers(refitted, rows, j);
    for (const double horizon_s : kHorizonsS) {
      const PlantDrive::Errors before = given.under_effort(horizon_s);
      if (before.rows == 0.0) continue;
      const Drift drift{joint.name,
                        position_unit_of(joint),
                        horizon_s,
                        before.rms(),
                        with_own_numbers.under_effort(horizon_s).rms(),
                        improved.under_effort(horizon_s).rms()};
      if (horizon_s == kWindowS) add("free_run_1s_rmse", drift.before, drift.after);
      report.drift.push_back(drift);
    }
    const auto given_law = law_of(view.given, rows, j);
    const auto improved_law = law_of(view.improved, rows, j);
    if (!given_law || !improved_law) continue;
    const PlantDrive::Errors closed_before = given.under(*given_law);
    if (closed_before.rows == 0.0) continue;
    const PlantDrive::Errors closed_after = improved.under(*improved_law);
    add("closed_loop_rmse", closed_before.rms(), closed_after.rms());
    add("closed_loop_mae", closed_before.mean(), closed_after.mean());
  }
}

}  // namespace ravencal::diagnose
