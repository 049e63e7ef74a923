// SPDX-License-Identifier: Apache-2.0
#include "prove/generator/other/arm.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace ravencal::prove {

using Eigen::Index;

namespace {

constexpr int kSteps = 20;  // per millisecond

/// Dry friction after a step of `travel` at `velocity`; `scale` is of the level.
double rubbed(const DryFriction& f, double exponent, double effort, double velocity,
              double position, double load, double scale, double travel) {
  const double reference = f.level + f.stribeck_extra + f.local.height;
  const double slope = (reference > 0.0 ? reference : f.load_share) / f.displacement;
  if (slope <= 0.0) return 0.0;
  const double level = (hess_soom_level(f.level, f.stribeck_extra, f.stribeck_velocity, velocity) +
                        f.load_share * std::abs(load) + f.local.at(position)) *
                       scale * (1.0 + (velocity < 0.0 ? -f.asymmetry : f.asymmetry));
  // Friction that goes with a load does not vanish where the load changes sign.
  return dahl_after(effort, std::max(level, 0.01 * slope * f.displacement), slope, exponent,
                    travel);
}

}  // namespace

core::Result<OtherArm> OtherArm::create(const RobotPhysics& robot, const OtherLaws& laws) {
  OtherArm arm(robot, laws);
  if (robot.mujoco) {
    RAVENCAL_ASSIGN_OR_RETURN(arm.mujoco_, MujocoArm::create(robot.chain));
  }
  return arm;
}

/// A cable that follows links ends on them, any other on the drives of the joints that move it.
OtherArm::OtherArm(const RobotPhysics& robot, const OtherLaws& laws)
    : robot_(robot), laws_(laws), state_(robot.joints.size()) {
  Eigen::Matrix3d gain = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d over_drives = robot.coupling, over_links = robot.coupling;
  for (std::size_t i = 0; i < robot.joints.size(); ++i) {
    const auto row = static_cast<Index>(i);
    gain(row, row) += robot.joints[i].cable.ratio_error;
    (robot.joints[i].follows_links ? over_drives : over_links).row(row).setZero();
  }
  const Eigen::Matrix3d coupled = (Eigen::Matrix3d::Identity() - over_drives).inverse();
  drive_from_motor_ = coupled * gain;
  drive_from_joint_ = coupled * over_links;
}

Vector3d OtherArm::gathered(double Joint::*which) const {
  Vector3d out = Vector3d::Zero();
  for (std::size_t i = 0; i < state_.size(); ++i) out[static_cast<Index>(i)] = state_[i].*which;
  return out;
}

void OtherArm::place(const Vector3d& joints) {
  const Eigen::Matrix3d pulled = Eigen::Matrix3d::Identity() - drive_from_joint_.transpose();
  const Vector3d tension = pulled.inverse() * robot_.chain.weight(joints);
  Vector3d drive = joints;
  for (std::size_t i = 0; i < state_.size(); ++i) {
    const auto n = static_cast<Index>(i);
    drive[n] += tension[n] / robot_.joints[i].cable.stiffness;
    state_[i] = Joint{};
    state_[i].joint = state_[i].flexible = joints[n];
    state_[i].stretch = drive[n] - joints[n];
  }
  const Vector3d motors = drive_from_motor_.inverse() * (drive - drive_from_joint_ * joints);
  for (std::size_t i = 0; i < state_.size(); ++i) state_[i].motor = motors[static_cast<Index>(i)];
}

core::Status OtherArm::advance(const CycleInputs& inputs, double dt_s) {
  const Vector3d q = joints(), v = gathered(&Joint::joint_velocity);
  const ChainDynamics now = mujoco_ ? mujoco_->at(q, v) : robot_.chain.at(q, v);
  bias_ = now.bias;
  inverse_mass_ = now.mass.inverse();
  for (int n = 0; n < kSteps; ++n) step(inputs, dt_s / kSteps);
  if (joints().allFinite() && motors().allFinite()) return {};
  return core::Error{core::ErrorCode::kData, "the other world's steps lost the robot"};
}

void OtherArm::pull_cable(Index i, double drive, double drive_velocity, double length,
                          double dt_s) {
  Joint& s = state_[static_cast<std::size_t>(i)];
  const JointPhysics& joint = robot_.joints[static_cast<std::size_t>(i)];
  const CablePhysics& c = joint.cable;
  const double phase = c.eccentricity.order * s.motor + c.eccentricity.phase_rad;
  const double end = drive + length + c.eccentricity.amplitude * std::sin(phase) + c.bump.at(drive);
  s.run_out_slope = c.eccentricity.amplitude * c.eccentricity.order * std::cos(phase);
  const double end_velocity = drive_velocity + s.run_out_slope * s.motor_velocity;
  const double stretch = stretch_behind_play(end - s.joint - s.creep.strain(), c.gap_half_width,
                                             c.stiffness, joint.prismatic ? 10.0 : 1.0);
  const double held =
      c.stiffness * stretch +
      s.strands.move(c.hysteresis.stiffness, c.hysteresis.yield, stretch - s.stretch);
  s.stretch = stretch;
  s.creep.step(held, c.creep.compliance, c.creep.time_s, dt_s);
  s.tension = held + c.damping * contact_share(stretch, c.gap_half_width) *
                         (end_velocity - s.joint_velocity);
}

/// The current follows its command with the lag of its loop; torque follows the current.
double OtherArm::drive_effort(Index i, double command, double disturbance, double dt_s) {
  Joint& s = state_[static_cast<std::size_t>(i)];
  const JointPhysics& joint = robot_.joints[static_cast<std::size_t>(i)];
  s.current = command + (s.current - command) * std::exp(-dt_s / laws_.current_lag_s);
  return soft_limit(s.current, joint.saturation) * (1.0 + joint.torque_ratio) +
         joint.ripple.amplitude * std::sin(joint.ripple.order * s.motor + joint.ripple.phase_rad) +
         disturbance;
}

/// Moves the flexible mass; gives its effort on the joint.
double OtherArm::bend_flexible(Index i, double dt_s) {
  Joint& s = state_[static_cast<std::size_t>(i)];
  const JointPhysics& joint = robot_.joints[static_cast<std::size_t>(i)];
  if (joint.flexible_inertia <= 0.0) return 0.0;
  const double effort = joint.flexible_stiffness * (s.flexible - s.joint) +
                        joint.flexible_damping * (s.flexible_velocity - s.joint_velocity);
  s.flexible_velocity -= dt_s * effort / joint.flexible_inertia;
  s.flexible += dt_s * s.flexible_velocity;
  return effort;
}

void OtherArm::rub(Index i, double scale, double dt_s) {
  const auto n = static_cast<std::size_t>(i);
  Joint& s = state_[n];
  const JointPhysics& joint = robot_.joints[n];
  s.motor_friction = rubbed(joint.motor_friction, laws_.motor_exponent[n], s.motor_friction,
                            s.motor_velocity, s.motor, s.tension, scale, dt_s * s.motor_velocity);
  s.joint_friction = rubbed(joint.joint_friction, laws_.joint_exponent[n], s.joint_friction,
                            s.joint_velocity, s.joint, s.tension, 1.0, dt_s * s.joint_velocity);
}

void OtherArm::step(const CycleInputs& inputs, double dt_s) {
  const auto count = static_cast<Index>(state_.size());
  const Vector3d drive = drive_from_motor_ * motors() + drive_from_joint_ * joints();
  const Vector3d drive_velocity = drive_from_motor_ * gathered(&Joint::motor_velocity) +
                                  drive_from_joint_ * gathered(&Joint::joint_velocity);
  Vector3d joint_effort = Vector3d::Zero();
  for (Index i = 0; i < count; ++i) {
    pull_cable(i, drive[i], drive_velocity[i], inputs.length[i], dt_s);
    const Joint& s = state_[static_cast<std::size_t>(i)];
    joint_effort[i] = s.tension - bias_[i] - s.joint_friction + bend_flexible(i, dt_s);
  }
  // Virtual work: a cable pulls at whatever moves its end.
  const Vector3d tension = tensions();
  const Vector3d reaction = drive_from_motor_.transpose() * tension;
  const Vector3d acceleration =
      inverse_mass_ * (joint_effort - drive_from_joint_.transpose() * tension);
  for (Index i = 0; i < count; ++i) {
    Joint& s = state_[static_cast<std::size_t>(i)];
    const JointPhysics& joint = robot_.joints[static_cast<std::size_t>(i)];
    const double asymmetry = joint.motor_friction.asymmetry;
    const double viscous = joint.viscous * s.motor_velocity *
                           (1.0 + (s.motor_velocity < 0.0 ? -asymmetry : asymmetry));
    const double effort = drive_effort(i, inputs.effort[i], inputs.disturbance[i], dt_s) -
                          s.motor_friction - viscous - reaction[i] - s.run_out_slope * tension[i] -
                          joint.leak.share * tension[joint.leak.from];
    s.motor_velocity += dt_s * effort / joint.motor_inertia;
    s.joint_velocity += dt_s * acceleration[i];
    s.motor += dt_s * s.motor_velocity;
    s.joint += dt_s * s.joint_velocity;
    rub(i, inputs.friction_scale[i], dt_s);
  }
}

double OtherArm::energy() const {
  const auto count = static_cast<Index>(state_.size());
  const Vector3d v = gathered(&Joint::joint_velocity);
  const Eigen::Matrix3d mass = robot_.chain.at(joints(), v).mass;
  double energy = 0.5 * v.head(count).dot(mass.topLeftCorner(count, count) * v.head(count));
  for (std::size_t i = 0; i < state_.size(); ++i) {
    const Joint& s = state_[i];
    const JointPhysics& joint = robot_.joints[i];
    const double bend = s.flexible - s.joint;
    energy += 0.5 * (joint.motor_inertia * s.motor_velocity * s.motor_velocity +
                     joint.cable.stiffness * s.stretch * s.stretch +
                     joint.flexible_inertia * s.flexible_velocity * s.flexible_velocity +
                     joint.flexible_stiffness * bend * bend);
  }
  return energy;
}

}  // namespace ravencal::prove
