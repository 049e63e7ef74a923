// SPDX-License-Identifier: Apache-2.0
#include "diagnose/explain/plant_drive.hpp"

#include <algorithm>
#include <limits>

#include "physics/drives.hpp"
#include "physics/plant_effort.hpp"

namespace ravencal::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

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

}  // namespace

PlantDrive::PlantDrive(const physics::Plant& plant, const Likelihood& rows, std::size_t joint)
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

/// Rows on which the drive can run, end to end, each window within one episode and at most
/// `longest_s` long.
std::vector<PlantDrive::Window> PlantDrive::windows_of(const Track& track,
                                                       const VectorXd& driven_by, double least_s,
                                                       double longest_s) const {
  if (track.at_rest) return {};
  const VectorXd& t_s = track.forced.t_s;
  const auto usable = [&](Index i) {
    return track.lost[joint_][static_cast<std::size_t>(i)] == 0 && std::isfinite(driven_by[i]);
  };
  std::vector<Window> out;
  for (Index first = 0, last = 0; first < track.rows(); first = std::max(last, first + 1)) {
    last = first;
    while (last < track.rows() && usable(last) && t_s[last] - t_s[first] < longest_s &&
           (last == first || track.forced.fresh[static_cast<std::size_t>(last)] == 0))
      ++last;
    if (last > first + 1 && t_s[last - 1] - t_s[first] >= least_s) out.push_back({first, last});
  }
  return out;
}

void PlantDrive::run(const std::optional<physics::ServoLaw>& law, double window_s,
                     const AddWindow& add) {
  drive_.law = law;
  for (std::size_t r = 0; r < rows_.tracks().size(); ++r) {
    const Track& track = rows_.tracks()[r];
    const JointTrack& recorded = track.joints[joint_];
    const VectorXd& driven_by = law ? recorded.desired : recorded.effort;
    if (driven_by.size() == 0) continue;
    const double least_s = law ? kLeastStretchS : kLeastWindow * window_s;
    const std::vector<Window> windows = windows_of(track, driven_by, least_s, window_s);
    if (!windows.empty()) run(r, windows, add);
  }
}

void PlantDrive::run(std::size_t r, const std::vector<Window>& windows, const AddWindow& add) {
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
  for (const Window& window : windows) {
    const Index end = physics::run_drive(drive_, signals, window.first, window.last, ran);
    VectorXd errors = VectorXd::Constant(window.last - window.first - 1, kFarOff);
    for (Index i = window.first + 1; i < end; ++i) {
      const double error = ran.position[i] - position[i];
      if (std::isfinite(error)) errors[i - window.first - 1] = std::clamp(error, -kFarOff, kFarOff);
    }
    add(errors);
  }
}

PlantDrive::Errors PlantDrive::under_effort(double window_s) {
  Errors out;
  run({}, window_s, [&](const VectorXd& errors) {
    for (const double error : errors) out.add(error);
  });
  return out;
}

PlantDrive::Errors PlantDrive::under(const physics::ServoLaw& law) {
  Errors out;
  run(law, std::numeric_limits<double>::infinity(), [&](const VectorXd& errors) {
    for (const double error : errors) out.add(error);
  });
  return out;
}

std::vector<VectorXd> PlantDrive::windows_under_effort(double window_s) {
  std::vector<VectorXd> out;
  run({}, window_s, [&](const VectorXd& errors) { out.push_back(errors); });
  return out;
}

/// What all cables ask of the motor, but the inertia and the friction that the drive has itself.
physics::DriveLoad PlantDrive::load_along(std::size_t r, const VectorXd& side) const {
  if (auto pendulum = physics::pendulum_load(plant_)) return *pendulum;
  physics::Plant others = plant_;
  set_plant_number(others, joint_, "joint_friction", "level", 0.0);
  const Track& track = rows_.tracks()[r];
  physics::DriveLoad load{asked_of_motor(r, others)};
  // While other joints move it, a joint does not turn with its motor, nor does its friction.
  if (physics::coupled(plant_, joint_) && track.joints[joint_].effort.size() > 0)
    load.recorded = asked_of_motor(r, plant_) -
                    plant_.joints[joint_].parameter("joint_friction", "level") * side;
  const double inertia = physics::link_inertia(plant_, joint_);
  load.recorded -= inertia * track.forced.motors[joint_].a;
  return load;
}

VectorXd PlantDrive::asked_of_motor(std::size_t r, const physics::Plant& plant) const {
  const physics::Prediction prediction = rows_.predictor(r).predict(plant);
  const Eigen::MatrixXd of_motor = physics::drive_kinematics(plant).of_motor;
  VectorXd asked = VectorXd::Zero(rows_.tracks()[r].rows());
  for (std::size_t k = 0; k < plant.joints.size(); ++k)
    asked += of_motor(static_cast<Index>(k), static_cast<Index>(joint_)) * prediction.tension[k];
  return asked;
}

}  // namespace ravencal::diagnose
