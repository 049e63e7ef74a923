// SPDX-License-Identifier: Apache-2.0
#include "prove/generator/session.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace ravencal::prove {
namespace {

using Eigen::Index;

constexpr double kCycleS = 1e-3;
constexpr double kSettleS = 1.5;  // at rest before the recording begins
constexpr double kTwoPi = 2.0 * std::numbers::pi;

struct Reading {
  double stamp_s;
  Vector3d value;
};
struct Row {
  double t_s;
  Vector3d desired, motor_rad, motor_velocity, estimate, torque;
};

/// What disturbs one joint; every source has its own stream, stepped once a cycle whatever happens.
class Disturber {
 public:
  Disturber(const JointSession& joint, std::uint64_t seed, const std::string& name, bool on)
      : joint_(joint),
        on_(on),
        effort_random_(seed, name + ".effort"),
        level_random_(seed, name + ".level"),
        effort_(joint.disturbance, 0.7, kCycleS),
        level_(joint.friction_wander, 10.0, kCycleS) {}

  void apply(double t_s, Index i, CycleInputs& inputs) {
    const double effort = effort_.step(effort_random_);
    const double level = level_.step(level_random_);
    inputs.disturbance[i] =
        (on_ ? effort : 0.0) + joint_.hum * std::sin(kTwoPi * joint_.hum_hz * t_s);
    const double warm =
        joint_.friction_warm_up * std::exp(-std::max(0.0, t_s) / joint_.warm_up_time_s);
    inputs.friction_scale[i] = std::max(0.1, 1.0 + (on_ ? level : 0.0) + warm);
    double length = joint_.drift * (1.0 - std::exp(-std::max(0.0, t_s) / joint_.drift_time_s));
    for (const auto& [at_s, size] : joint_.slips)
      length += size * std::clamp((t_s - at_s) / 0.03, 0.0, 1.0);
    inputs.length[i] = length;
  }

 private:
  const JointSession& joint_;
  bool on_;
  Random effort_random_, level_random_;
  Coloured effort_, level_;
};

/// Noise of one joint's external encoder, stepped at each of its readings.
class TruthSensor {
 public:
  TruthSensor(const JointSession& joint, std::uint64_t seed, const std::string& name, bool on,
              double period_s)
      : joint_(joint),
        on_(on),
        random_(seed, name + ".truth"),
        coloured_(joint.coloured, 2.0, period_s),
        walk_step_(joint.walk_per_root_s * std::sqrt(period_s)) {}

  double read(double position) {
    const double white = joint_.white * random_.normal();
    const double coloured = coloured_.step(random_);
    walk_ += walk_step_ * random_.normal();
    double value = position + joint_.truth_offset + (on_ ? white + coloured + walk_ : 0.0);
    if (joint_.truth_resolution > 0.0)
      value = joint_.truth_resolution * std::round(value / joint_.truth_resolution);
    return value;
  }

 private:
  const JointSession& joint_;
  bool on_;
  Random random_;
  Coloured coloured_;
  double walk_step_;
  double walk_ = 0.0;
};

class Runner {
 public:
  Runner(const Session& session, const SessionSeeds& seeds, Mechanics mechanics)
      : session_(session),
        seeds_(seeds),
        mechanics_(std::move(mechanics)),
        count_(static_cast<Index>(session.joints.size())),
        stamps_(seeds.noise, "stamps") {
    for (std::size_t i = 0; i < session.joints.size(); ++i) {
      const std::string& name = session.robot.joints[i].name;
      paths_.emplace_back(session.joints[i].range, session.motion, session.duration_s + 1.0,
                          Random(seeds.motion, name));
      disturbers_.emplace_back(session.joints[i], seeds.noise, name, session.with_noise);
      sensors_.emplace_back(session.joints[i], seeds.noise, name, session.with_noise,
                            session.truth_period_s);
    }
    motor_from_joint_ = Eigen::Matrix3d::Identity() - session.believed_coupling;
    joint_from_motor_ = motor_from_joint_.inverse();
    next_reading_s_ = stamps_.uniform() * session.truth_period_s;
  }

  core::Status run(const std::function<bool()>& look) {
    mechanics_.place(desired_at(0.0));
    const auto settle = static_cast<long>(kSettleS / kCycleS);
    const auto cycles = static_cast<long>(session_.duration_s / kCycleS);
    for (long cycle = -settle; cycle < cycles; ++cycle) {
      RAVENCAL_RETURN_IF_ERROR(step(cycle));
      if (cycle % 1000 == 0 && look && !look())
        return core::Error{core::ErrorCode::kUsage, "stopped; the same command continues"};
    }
    return {};
  }

  [[nodiscard]] record::Recording recording() const;

 private:
  [[nodiscard]] Vector3d desired_at(double t_s) const {
    Vector3d desired = Vector3d::Zero();
    for (Index i = 0; i < count_; ++i) desired[i] = paths_[static_cast<std::size_t>(i)].at(t_s);
    return desired;
  }

  core::Status step(long cycle) {
    const double t_s = static_cast<double>(cycle) * kCycleS;
    read_truth(t_s);
    Row row = servo(t_s);
    if (cycle >= 0 && cycle % session_.cycles_per_row == 0) rows_.push_back(row);
    for (Index i = 0; i < count_; ++i)
      disturbers_[static_cast<std::size_t>(i)].apply(t_s, i, inputs_);
    return mechanics_.advance(inputs_, kCycleS);
  }

  /// Motion of the external encoder's mount.
  static double carried(const JointSession& j, const Vector3d& joints, Index i, double t_s) {
    const double other = joints[static_cast<Index>(j.bend.with)];
    return j.bend.share * (joints[i] - j.bend.centre) * (other - j.bend.centre_with) +
           j.sway * std::sin(kTwoPi * j.sway_hz * t_s);
  }

  /// The truth of joints with a delay of their own is what they were that long ago.
  void read_truth(double t_s) {
    const Vector3d joints = mechanics_.joints();
    history_.push_back(joints);
    while (next_reading_s_ <= t_s) {
      Reading reading{0.0, Vector3d::Zero()};
      for (Index i = 0; i < count_; ++i) {
        const auto n = static_cast<std::size_t>(i);
        const auto back =
            static_cast<std::size_t>(session_.joints[n].truth_delay_s / kCycleS + 0.5);
        const Vector3d& then = history_[history_.size() - 1 - std::min(back, history_.size() - 1)];
        reading.value[i] = sensors_[n].read(then[i] + carried(session_.joints[n], then, i, t_s));
      }
      const double latency_s = std::max(
          0.0, session_.truth_latency_s + session_.truth_latency_deviation_s * stamps_.normal());
      const double last_s = readings_.empty() ? -1.0 : readings_.back().stamp_s;
      reading.stamp_s = std::max(last_s, (t_s + latency_s) * (1.0 + session_.truth_clock_error));
      readings_.push_back(reading);
      next_reading_s_ += session_.truth_period_s;
    }
  }

  Row servo(double t_s) {
    Row row;
    row.t_s = t_s;
    row.desired = desired_at(std::max(0.0, t_s));
    const Vector3d wanted = motor_from_joint_ * row.desired;
    const Vector3d motors = mechanics_.motors();
    Vector3d measured = Vector3d::Zero();
    for (Index i = 0; i < count_; ++i) {
      const auto n = static_cast<std::size_t>(i);
      const JointSession& j = session_.joints[n];
      const JointPhysics& p = session_.robot.joints[n];
      const double quantum = kTwoPi / j.motor_counts_per_rev;
      double counts = std::floor(motors[i] * p.reduction / quantum);
      for (const auto& [at_s, lost] : j.lost_counts)
        if (t_s >= at_s) counts += static_cast<double>(lost);
      row.motor_rad[i] = counts * quantum;
      row.motor_velocity[i] = started_ ? (row.motor_rad[i] - last_motor_[i]) / kCycleS : 0.0;
      double torque =
          j.kp * (wanted[i] * p.reduction - row.motor_rad[i]) - j.kd * row.motor_velocity[i];
      const double to_joint = p.reduction / p.gearbox_ratio;
      for (const auto& pulse : j.pulses)
        if (t_s >= pulse.begin_s && t_s < pulse.end_s) torque += pulse.effort / to_joint;
      double dac = std::trunc(torque * j.dac_counts_per_n_m);
      if (j.dac_limit_counts > 0.0) dac = std::clamp(dac, -j.dac_limit_counts, j.dac_limit_counts);
      row.torque[i] = dac / j.dac_counts_per_n_m;
      inputs_.effort[i] = row.torque[i] * to_joint;
      measured[i] = row.motor_rad[i] / p.reduction;
    }
    last_motor_ = row.motor_rad;
    started_ = true;
    row.estimate = joint_from_motor_ * measured;
    return row;
  }

  const Session& session_;
  SessionSeeds seeds_;
  Mechanics mechanics_;
  Index count_;
  Random stamps_;
  std::vector<Path> paths_;
  std::vector<Disturber> disturbers_;
  std::vector<TruthSensor> sensors_;
  Eigen::Matrix3d motor_from_joint_, joint_from_motor_;
  CycleInputs inputs_;
  std::vector<Vector3d> history_;
  std::vector<Reading> readings_;
  std::vector<Row> rows_;
  Vector3d last_motor_ = Vector3d::Zero();
  bool started_ = false;
  double next_reading_s_ = 0.0;
};

record::Recording Runner::recording() const {
  record::Recording out;
  using record::Role;
  for (std::size_t i = 0; i < session_.joints.size(); ++i) {
    const JointPhysics& joint = session_.robot.joints[i];
    const std::string unit = joint.prismatic ? "m" : "rad";
    const auto add = [&](const char* what, const std::string& u, Role role) {
      out.channels.push_back({joint.name + "." + what, u, role, joint.name});
    };
    add("desired", unit, Role::kDesiredPosition);
    add("motor", "rad", Role::kMotorPosition);
    add("motor_velocity", "rad_per_s", Role::kMotorVelocity);
    add("estimate", unit, Role::kJointEstimate);
    if (session_.with_torque) add("torque", "N_m", Role::kDriveTorque);
    if (session_.with_truth) add("truth", unit, Role::kJointTruth);
  }
  out.samples.resize(static_cast<Index>(rows_.size()), static_cast<Index>(out.channels.size()));
  Random lost(seeds_.noise, "lost rows");
  std::size_t nearest = 0;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const Row& row = rows_[r];
    out.t_ns.push_back(std::llround(row.t_s * 1e9));
    // Of readings with one stamp the latest counts.
    while (nearest + 1 < readings_.size() && std::abs(readings_[nearest + 1].stamp_s - row.t_s) <=
                                                 std::abs(readings_[nearest].stamp_s - row.t_s)) {
      ++nearest;
    }
    const bool gone = lost.uniform() < session_.lost_truth;
    Index column = 0;
    for (Index i = 0; i < count_; ++i) {
      for (const double value :
           {row.desired[i], row.motor_rad[i], row.motor_velocity[i], row.estimate[i]})
        out.samples(static_cast<Index>(r), column++) = value;
      if (session_.with_torque) out.samples(static_cast<Index>(r), column++) = row.torque[i];
      if (session_.with_truth)
        out.samples(static_cast<Index>(r), column++) =
            gone ? std::numeric_limits<double>::quiet_NaN() : readings_[nearest].value[i];
    }
  }
  return out;
}

}  // namespace

core::Result<record::Recording> run_session(const Session& session, const SessionSeeds& seeds,
                                            const std::function<bool()>& look) {
  RAVENCAL_ASSIGN_OR_RETURN(Mechanics mechanics, Mechanics::create(session.robot));
  Runner runner(session, seeds, std::move(mechanics));
  RAVENCAL_RETURN_IF_ERROR(runner.run(look));
  return runner.recording();
}

}  // namespace ravencal::prove
