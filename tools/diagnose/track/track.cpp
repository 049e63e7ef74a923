// SPDX-License-Identifier: Apache-2.0
#include "diagnose/track/track.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "core/median.hpp"
#include "diagnose/track/filter.hpp"
#include "diagnose/track/grid.hpp"
#include "diagnose/track/input.hpp"
#include "physics/predict/smoother.hpp"
#include "physics/servo_law.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using record::Recording;
using record::Role;

/// Over the move per row, 1/s: from which side a rest was approached, at a speed that nothing
/// feels.
constexpr double kRestSpeed = 1e-9;

/// A recorder that pairs the nearest stamps adds nothing on average, one that repeats the latest
/// reading half a period: which it does, no plant says.
double truth_lateness_s(const physics::Logger& logger) {
  return logger.truth_latency_s > 0.0 ? logger.truth_latency_s + 0.25 * logger.truth_period_s : 0.0;
}

class TrackBuilder {
 public:
  TrackBuilder(const Recording& recording, const physics::Plant& plant, Grid grid)
      : recording_(recording), plant_(plant), grid_(std::move(grid)) {}

  Track build() {
    Track track;
    track.period_s = grid_.period_s;
    track.begins_s = grid_.begins_s;
    track.at_rest = grid_.at_rest;
    track.tent_rows = grid_.at_rest ? 1 : std::max<Index>(1, std::lround(kTentS / grid_.period_s));
    track.forced.t_s = grid_.t_s;
    track.forced.fresh = grid_.fresh;
    track.forced.homed = true;
    track.lost.assign(plant_.joints.size(),
                      std::vector<char>(static_cast<std::size_t>(grid_.rows()), 0));
    for (std::size_t j = 0; j < plant_.joints.size(); ++j) {
      estimates_.push_back(estimate_of(j));
      desired_.push_back(signal(Role::kDesiredPosition, plant_.joints[j].name));
    }
    const std::vector<char> off = switched_off();
    for (std::size_t j = 0; j < plant_.joints.size(); ++j) {
      track.lost[j] = off;
      add_joint(j, track);
    }
    for (const physics::Joint& joint : plant_.joints)
      track.forced.external_loads.push_back(
          joint.external_load ? physics::without_gaps(channel(joint.external_load->channel))
                              : VectorXd());
    add_loads(track);
    return track;
  }

 private:
  [[nodiscard]] VectorXd channel(const std::string& name) const {
    return mean_of(recording_.column(name));
  }

  /// By the plant's coupling where only motors were recorded.
  [[nodiscard]] VectorXd estimate_of(std::size_t j) const {
    const physics::Joint& joint = plant_.joints[j];
    VectorXd estimate = signal(Role::kJointEstimate, joint.name);
    if (estimate.size() > 0) return estimate;
    estimate = signal(Role::kMotorPosition, joint.name) / joint.reduction;
    if (estimate.size() == 0) return estimate;
    for (std::size_t k = 0; k < j; ++k)
      if (plant_.coupling[j][k] != 0.0 && estimates_[k].size() > 0)
        estimate += plant_.coupling[j][k] * estimates_[k];
    return estimate;
  }

  void add_loads(Track& track) const {
    std::map<std::string, VectorXd> loads;
    for (const record::Channel& load : recording_.channels) {
      if (load.role != Role::kLoad && !is_effort_of_no_joint(load)) continue;
      const VectorXd values = channel(load.name);
      if (values.size() == 0) continue;
      loads[load.name] = physics::without_gaps(values);
      const bool from_outside =
          std::any_of(plant_.joints.begin(), plant_.joints.end(), [&](const physics::Joint& joint) {
            return joint.external_load && joint.external_load->channel == load.name;
          });
      if (!from_outside) track.loads.push_back({load.name, load.unit, load.joint});
    }
    track.forced.load = [loads = std::move(loads)](const std::string& name) {
      const auto load = loads.find(name);
      return load == loads.end() ? VectorXd() : load->second;
    };
  }

  void add_joint(std::size_t j, Track& track) {
    const physics::Joint& joint = plant_.joints[j];
    JointTrack out;
    out.effort = signal(Role::kDriveTorque, joint.name) * effort_scale(joint, true);
    if (out.effort.size() == 0)
      out.effort = signal(Role::kDriveInput, joint.name) * effort_scale(joint, false);
    out.effort_power = effort_power(joint, out.effort);
    out.truth = signal(Role::kJointTruth, joint.name);
    if (out.truth.size() > 0) track.forced.truth_lateness_s = truth_lateness_s(plant_.logger);
    const VectorXd desired = desired_[j].size() > 0 ? without_coupling(j, desired_) : VectorXd();
    VectorXd motor = signal(Role::kMotorPosition, joint.name) / joint.reduction;
    if (motor.size() == 0 && estimates_[j].size() > 0) motor = without_coupling(j, estimates_);
    // Nothing but the command was recorded beside a position: that is what followed it.
    out.tracking =
        out.truth.size() == 0 && out.effort.size() == 0 && desired.size() > 0 && motor.size() > 0;
    const auto law = physics::servo_law(joint);
    const bool followed = out.tracking && law && law->position > 0.0;
    if (followed) {
      out.truth = motor;
    } else if (out.tracking) {
      out.truth = estimates_[j];
      motor = desired;
    } else {
      out.desired = desired;
    }
    if (motor.size() == 0) motor = desired;
    // What stands for the motor cannot be compared with it.
    if (motor.size() == 0) std::swap(motor, out.truth);
    if (motor.size() == 0) {
      out.effort = {};  // nothing says how it moves
      motor = VectorXd::Zero(grid_.rows());
    }
    mark_lost(motor, track.lost[j]);
    if (followed) mark_lost(desired, track.lost[j]);
    motor = physics::without_gaps(motor);
    track.forced.followed.push_back(followed ? physics::without_gaps(desired) : VectorXd());
    track.forced.motors.push_back(followed ? physics::smooth_motion(grid_.t_s, motor, grid_.fresh)
                                           : motion_of(motor));
    const double noise = track.forced.motors.back().noise = motor_noise(joint);
    // A plant that states no encoder has a default one, which may be coarser than the recording.
    const double stated =
        2.0 * std::numbers::pi / plant_.sensors.motor_encoder_counts_per_rev / joint.reduction;
    out.quantum = std::min(stated, std::max(least_step(joint), std::sqrt(12.0) * noise));
    track.joints.push_back(std::move(out));
  }

  [[nodiscard]] physics::Motion motion_of(const VectorXd& motor) const {
    if (grid_.at_rest)
      return {motor, kRestSpeed * first_difference(motor, 1.0), VectorXd::Zero(motor.size()), 0.0};
    return {motor, first_difference(motor, grid_.period_s),
            second_difference(motor, grid_.period_s), 0.0};
  }

  /// Of the recorded rows about the cubics through their neighbours: fourth differences leave out
  /// cubics, and their median what is jolted.
  [[nodiscard]] double motor_noise(const physics::Joint& joint) const {
    constexpr double kVariances = 70.0;  // 1 + 16 + 36 + 16 + 1
    const auto motor = recording_.column(Role::kMotorPosition, joint.name);
    const auto column = motor ? motor : recording_.column(Role::kJointEstimate, joint.name);
    if (!column) return 0.0;
    const auto& x = recording_.samples.col(*column);
    std::vector<double> differences;
    for (Index i = grid_.first.front() + 2; i + 2 < grid_.end(); ++i) {
      const double difference = x[i - 2] + x[i + 2] - 4.0 * (x[i - 1] + x[i + 1]) + 6.0 * x[i];
      if (std::isfinite(difference)) differences.push_back(difference);
    }
    if (differences.empty()) return 0.0;
    const double deviation = core::normal_deviation(std::move(differences));
    return deviation / std::sqrt(kVariances) / (motor ? joint.reduction : 1.0);
  }

  /// Between recorded positions that differ, most of the greater ones apart.
  [[nodiscard]] double least_step(const physics::Joint& joint) const {
    constexpr double kFewest = 0.02;
    const auto motor = recording_.column(Role::kMotorPosition, joint.name);
    const auto column = motor ? motor : recording_.column(Role::kJointEstimate, joint.name);
    if (!column) return 0.0;
    const auto& x = recording_.samples.col(*column);
    std::vector<double> steps;
    for (Index i = grid_.first.front() + 1; i < grid_.end(); ++i)
      if (const double step = std::abs(x[i] - x[i - 1]); step > 0.0 && std::isfinite(step))
        steps.push_back(step);
    if (steps.empty()) return 0.0;
    return core::upper_quantile(std::move(steps), kFewest) / (motor ? joint.reduction : 1.0);
  }

  /// Of the samples' variance, what is no noise: that differs from sample to sample, so that values
  /// differ from the middle of their neighbours (Gasser, Sroka, Jennen-Steinmetz 1986).
  [[nodiscard]] double effort_power(const physics::Joint& joint, const VectorXd& rows) const {
    const auto torque = recording_.column(Role::kDriveTorque, joint.name);
    const auto column = torque ? torque : recording_.column(Role::kDriveInput, joint.name);
    if (grid_.at_rest || !column || rows.size() == 0) return 0.0;
    const auto& x = recording_.samples.col(*column);
    double sum = 0.0, squares = 0.0, count = 0.0, noise = 0.0;
    for (Index i = grid_.first.front() + 1; i + 1 < grid_.end(); ++i) {
      const double off = x[i] - 0.5 * (x[i - 1] + x[i + 1]);
      if (!std::isfinite(off)) continue;
      sum += x[i];
      squares += x[i] * x[i];
      noise += off * off / 1.5;
      count += 1.0;
    }
    if (count == 0.0) return 0.0;
    return std::max(0.0, (squares - sum * sum / count - noise) / count) *
           std::pow(effort_scale(joint, torque.has_value()), 2);
  }

  /// At the joint, of a recorded torque or of a drive's input.
  static double effort_scale(const physics::Joint& joint, bool is_torque) {
    const double to_joint = joint.reduction / joint.gearbox_ratio;
    const double counts = joint.drive.dac_counts_per_n_m;
    return is_torque ? to_joint : to_joint * (counts != 0.0 ? 1.0 / counts : joint.drive.gain);
  }

  [[nodiscard]] VectorXd without_coupling(std::size_t j,
                                          const std::vector<VectorXd>& joints) const {
    VectorXd motor = joints[j];
    for (std::size_t k = 0; k < j; ++k)
      if (plant_.coupling[j][k] != 0.0 && joints[k].size() > 0)
        motor -= plant_.coupling[j][k] * joints[k];
    return motor;
  }

  static void mark_lost(const VectorXd& x, std::vector<char>& lost) {
    for (Index i = 0; i < x.size(); ++i)
      if (!std::isfinite(x[i])) lost[static_cast<std::size_t>(i)] = 1;
  }

  /// Where a status channel says that the drives were off, efforts are not what they did.
  [[nodiscard]] std::vector<char> switched_off() const {
    std::vector<char> off(static_cast<std::size_t>(grid_.rows()), 0);
    for (const record::Channel& status : recording_.channels) {
      if (status.role != Role::kStatus || status.name.find("torque_on") == std::string::npos)
        continue;
      const VectorXd on = channel(status.name);
      for (Index i = 0; i < on.size(); ++i)
        if (!(on[i] >= 0.5)) off[static_cast<std::size_t>(i)] = 1;
    }
    return off;
  }

  [[nodiscard]] VectorXd signal(Role role, const std::string& joint) const {
    return mean_of(recording_.column(role, joint));
  }

  /// Empty where nothing was recorded.
  [[nodiscard]] VectorXd mean_of(std::optional<Index> column) const {
    if (!column) return {};
    VectorXd out(grid_.rows());
    for (Index i = 0; i < grid_.rows(); ++i) {
      const auto row = static_cast<std::size_t>(i);
      out[i] = recording_.samples.col(*column).segment(grid_.first[row], grid_.samples[row]).mean();
    }
    if (!out.array().isFinite().any()) return {};
    return out;
  }

  const Recording& recording_;
  const physics::Plant& plant_;
  Grid grid_;
  std::vector<VectorXd> estimates_, desired_;  ///< [joint], at the joints
};

/// All recorded positions, where an effort stands beside one: a rest is compared by its effort.
std::vector<RecordedPosition> positions_of(const Recording& recording, const physics::Plant& plant,
                                           const Track& track) {
  std::vector<RecordedPosition> out;
  bool any_effort = false;
  for (std::size_t j = 0; j < plant.joints.size(); ++j) {
    const physics::Joint& joint = plant.joints[j];
    const auto motor = recording.column(Role::kMotorPosition, joint.name);
    const auto column = motor ? motor : recording.column(Role::kJointEstimate, joint.name);
    if (!column) continue;
    any_effort = any_effort || track.joints[j].effort.size() > 0;
    const double least = kStillQuanta * track.joints[j].quantum;
    out.push_back({*column, least * (motor ? std::abs(joint.reduction) : 1.0)});
  }
  if (!any_effort) out.clear();
  return out;
}

}  // namespace

core::Result<Track> make_track(const Recording& recording, const physics::Plant& plant,
                               double from_s, double to_s) {
  Grid grid = grid_of(recording, from_s, to_s);
  if (grid.rows() < kFewestTrackRows) {
    return core::data_error(
        fmt::format("{}: {} samples are too few to diagnose; at least {} are needed",
                    recording.source, grid.rows(), kFewestTrackRows));
  }
  const double period_s = grid.period_s;
  Track moving = TrackBuilder(recording, plant, std::move(grid)).build();
  auto rests = rests_of(recording, positions_of(recording, plant, moving), period_s, from_s, to_s);
  if (!rests) return moving;
  return TrackBuilder(recording, plant, std::move(*rests)).build();
}

}  // namespace ravencal::diagnose
