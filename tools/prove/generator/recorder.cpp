// SPDX-License-Identifier: Apache-2.0
#include "prove/generator/recorder.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace ravencal::prove {

using Eigen::Index;

namespace {

constexpr double kSettleS = 1.5;  // at rest before the recording begins
constexpr double kHomingS = 2.0;
constexpr double kTwoPi = 2.0 * std::numbers::pi;

/// Time along the desired motion: it stops within half a second before the robot is homed, and goes
/// on as gently afterwards.
double along(double t_s, double homed_at_s) {
  constexpr double kRampS = 0.5;
  if (homed_at_s <= 0.0 || t_s <= homed_at_s - kRampS) return t_s;
  if (t_s >= homed_at_s + kHomingS + kRampS) return t_s - kHomingS - kRampS;
  const double at_rest_s = homed_at_s - 0.5 * kRampS;
  const double off_s =
      t_s < homed_at_s ? t_s - homed_at_s : std::max(0.0, t_s - homed_at_s - kHomingS);
  return at_rest_s + 0.5 * off_s * std::abs(off_s) / kRampS;
}

double sum_of(const AddedOverTime& added, double t_s, double start = 0.0) {
  for (const auto& add : added) start += add(t_s);
  return start;
}

/// Channels and events.
record::Recording without_rows(const Session& session) {
  record::Recording out;
  using record::Role;
  for (std::size_t i = 0; i < session.joints.size(); ++i) {
    const JointPhysics& joint = session.robot.joints[i];
    const std::string unit = joint.prismatic ? "m" : "rad";
    const auto add = [&](const char* what, const std::string& u, Role role) {
      out.channels.push_back({joint.name + "." + what, u, role, joint.name});
    };
    add("desired", unit, Role::kDesiredPosition);
    add("motor", "rad", Role::kMotorPosition);
    add("motor_velocity", "rad_per_s", Role::kMotorVelocity);
    add("estimate", unit, Role::kJointEstimate);
    if (session.with_torque) add("torque", "N_m", Role::kDriveTorque);
    if (session.with_truth) add("truth", unit, Role::kJointTruth);
  }
  if (session.homed_at_s > 0.0 && session.homed_at_s + kHomingS < session.duration_s)
    out.events.push_back({std::llround(1e9 * (session.homed_at_s + kHomingS)), "homing", "1"});
  return out;
}

}  // namespace

Disturber::Disturber(const JointSession& joint, std::uint64_t seed, const std::string& name,
                     bool on)
    : joint_(joint),
      on_(on),
      effort_random_(seed, name + ".effort"),
      level_random_(seed, name + ".level"),
      effort_(joint.disturbance, 0.7, kCycleS),
      level_(joint.friction_wander, 10.0, kCycleS) {}

void Disturber::apply(double t_s, Index i, CycleInputs& inputs) {
  const double effort = effort_.step(effort_random_);
  const double level = level_.step(level_random_);
  inputs.disturbance[i] = sum_of(joint_.added_effort, t_s, on_ ? effort : 0.0);
  inputs.friction_scale[i] =
      std::max(0.1, sum_of(joint_.added_friction, t_s, 1.0 + (on_ ? level : 0.0)));
  inputs.length[i] = sum_of(joint_.added_length, t_s);
}

TruthSensor::TruthSensor(const JointSession& joint, std::uint64_t seed, const std::string& name,
                         bool on, double period_s)
    : joint_(joint),
      on_(on),
      random_(seed, name + ".truth"),
      coloured_(joint.coloured, 2.0, period_s),
      walk_step_(joint.walk_per_root_s * std::sqrt(period_s)) {}

double TruthSensor::read(double position) {
  const double white = joint_.white * random_.normal();
  const double coloured = coloured_.step(random_);
  walk_ += walk_step_ * random_.normal();
  double value = position + joint_.truth_offset + (on_ ? white + coloured + walk_ : 0.0);
  if (joint_.truth_resolution > 0.0)
    value = joint_.truth_resolution * std::round(value / joint_.truth_resolution);
  return value;
}

Recorder::Recorder(const Session& session, const SessionSeeds& seeds)
    : session_(session),
      seeds_(seeds),
      count_(static_cast<Index>(session.joints.size())),
      stamps_(seeds.noise, "stamps") {
  const double planned_s = std::max(session.planned_s, session.duration_s) + 1.0;
  for (std::size_t i = 0; i < session.joints.size(); ++i) {
    const std::string& name = session.robot.joints[i].name;
    paths_.emplace_back(session.joints[i].range, session.motion, planned_s,
                        Random(seeds.motion, name));
    disturbers_.emplace_back(session.joints[i], seeds.noise, name, session.with_noise);
    sensors_.emplace_back(session.joints[i], seeds.noise, name, session.with_noise,
                          session.truth_period_s);
  }
  motor_from_joint_ = Eigen::Matrix3d::Identity() - session.believed_coupling;
  joint_from_motor_ = motor_from_joint_.inverse();
  next_reading_s_ = stamps_.uniform() * session.truth_period_s;
}

Vector3d Recorder::desired_at(double t_s) const {
  Vector3d desired = Vector3d::Zero();
  const double path_s = along(t_s, session_.homed_at_s);
  for (Index i = 0; i < count_; ++i) desired[i] = paths_[static_cast<std::size_t>(i)].at(path_s);
  return desired;
}

double Recorder::encoder_rad(Index i, double motor, double t_s) const {
  const JointSession& j = session_.joints[static_cast<std::size_t>(i)];
  const double quantum = kTwoPi / j.motor_counts_per_rev;
  double counts =
      std::floor(motor * session_.robot.joints[static_cast<std::size_t>(i)].reduction / quantum);
  for (const auto& [at_s, lost] : j.lost_counts)
    if (t_s >= at_s) counts += static_cast<double>(lost);
  return counts * quantum;
}

double Recorder::added_torque_n_m(Index i, double t_s) const {
  const auto n = static_cast<std::size_t>(i);
  const JointPhysics& p = session_.robot.joints[n];
  return sum_of(session_.joints[n].added_input, t_s) / (p.reduction / p.gearbox_ratio);
}

void Recorder::disturb(double t_s, CycleInputs& inputs) {
  for (Index i = 0; i < count_; ++i) disturbers_[static_cast<std::size_t>(i)].apply(t_s, i, inputs);
}

/// The truth of joints with a delay of their own is what they were that long ago.
void Recorder::read_truth(double t_s, const Vector3d& joints) {
  history_.push_back(joints);
  while (next_reading_s_ <= t_s) {
    Reading reading{0.0, Vector3d::Zero()};
    for (Index i = 0; i < count_; ++i) {
      const auto n = static_cast<std::size_t>(i);
      const auto back =
          static_cast<std::size_t>(std::lround(session_.joints[n].truth_delay_s / kCycleS));
      const Vector3d& then = history_[history_.size() - 1 - std::min(back, history_.size() - 1)];
      double added = 0.0;
      for (const auto& add : session_.joints[n].added_truth) added += add(t_s, then);
      reading.value[i] = sensors_[n].read(then[i] + added);
    }
    const double latency_s = std::max(
        0.0, session_.truth_latency_s + session_.truth_latency_deviation_s * stamps_.normal());
    const double last_s = readings_.empty() ? -1.0 : readings_.back().stamp_s;
    reading.stamp_s = std::max(last_s, (t_s + latency_s) * (1.0 + session_.truth_clock_error));
    readings_.push_back(reading);
    next_reading_s_ += session_.truth_period_s;
  }
}

void Recorder::keep(long cycle, const RecordedRow& row) {
  const double from_s = session_.homed_at_s;
  const bool homes = from_s > 0.0 && row.t_s >= from_s && row.t_s < from_s + kHomingS;
  if (cycle >= 0 && cycle % session_.cycles_per_row == 0 && !homes) rows_.push_back(row);
}

record::Recording Recorder::recording() const {
  record::Recording out = without_rows(session_);
  out.samples.resize(static_cast<Index>(rows_.size()), static_cast<Index>(out.channels.size()));
  Random lost(seeds_.noise, "lost rows");
  std::size_t nearest = 0;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const RecordedRow& row = rows_[r];
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

core::Status run_cycles(const Session& session, const std::function<bool()>& look,
                        const std::function<core::Status(long cycle)>& step) {
  const auto settle = static_cast<long>(kSettleS / kCycleS);
  const auto cycles = static_cast<long>(session.duration_s / kCycleS);
  for (long cycle = -settle; cycle < cycles; ++cycle) {
    RAVENCAL_RETURN_IF_ERROR(step(cycle));
    if (cycle % 1000 == 0 && look && !look())
      return core::Error{core::ErrorCode::kUsage, "stopped; the same command continues"};
  }
  return {};
}

}  // namespace ravencal::prove
