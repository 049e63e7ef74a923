// SPDX-License-Identifier: Apache-2.0
#include "physics/raven_controller.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/constants.hpp"
#include "physics/effects/quantisation.hpp"

namespace ravencal::physics {
namespace {

using core::JointSlot;
using Eigen::Index;
using Eigen::Vector3d;

constexpr std::array<std::size_t, 4> kToolIndices = {4, 5, 6, 7};

// params/r2params.yaml, tool joints by slot; integral part left out: the tool is kinematic here.
constexpr SlotVector kToolKp = {0, 0, 0, 0, 0.09, 0.05, 0.05, 0.05};
constexpr SlotVector kToolKd = {0, 0, 0, 0, 0.001, 0, 0, 0};
constexpr SlotVector kToolDacLimit = {0, 0, 0, 0, 3000, 3000, 3800, 3800};
// RE30 at 0.0538 N m/A through 26/7, 5461 DAC counts per A; sign -1 with RAVEN tools.
constexpr double kToolDacPerTorque = -27328.0;

// homing.cpp: velocity ramp, rest at the stop.
constexpr double kHomingRampS = 1.0;
constexpr double kHomingSettleS = 0.2;

double tool_flip(std::size_t slot) {
  return slot == static_cast<std::size_t>(JointSlot::kGrasp1) ? -1.0 : 1.0;
}

}  // namespace

Vector3d joints_from_motors(const Plant& plant, const Vector3d& motors_rad) {
  Vector3d joints;
  for (Index i = 0; i < 3; ++i) {
    const auto n = static_cast<std::size_t>(i);
    joints[i] = motors_rad[i] / plant.joints[n].reduction;
    for (Index k = 0; k < i; ++k)
      joints[i] += plant.coupling[n][static_cast<std::size_t>(k)] * joints[k];
  }
  return joints;
}

Vector3d motors_from_joints(const Plant& plant, const Vector3d& joints_ji) {
  Vector3d motors;
  for (Index i = 0; i < 3; ++i) {
    const auto n = static_cast<std::size_t>(i);
    motors[i] = joints_ji[i];
    for (Index k = 0; k < i; ++k)
      motors[i] -= plant.coupling[n][static_cast<std::size_t>(k)] * joints_ji[k];
    motors[i] *= plant.joints[n].reduction;
  }
  return motors;
}

RavenController::RavenController(const Plant& plant, Arm arm)
    : plant_(&plant),
      arm_(arm),
      nominal_(plant, arm, false),
      cycle_s_(1.0 / plant.robot.control_rate_hz) {
  state_.type = plant.robot.controller.arm_types[arm == Arm::kGold ? 0 : 1];
  for (std::size_t i = 0; i < kToolIndices.size(); ++i) {
    state_.jpos_d_ji[kToolIndices[i]] = plant.robot.tool_joints_rad[i];
  }
  state_.grasp_d_rad = plant.robot.tool_joints_rad[2] + plant.robot.tool_joints_rad[3];
}

double RavenController::encoder_sign(std::size_t slot) const {
  if (slot < plant_->joints.size()) return plant_->joints[slot].encoder_sign;
  return -tool_flip(slot);
}

double RavenController::radians(std::size_t slot, std::int64_t counts) const {
  const double signed_counts = encoder_sign(slot) * static_cast<double>(counts);
  return core::kRadPerTurn / plant_->sensors.motor_encoder_counts_per_rev *
         (signed_counts - static_cast<double>(state_.encoder_offset[slot]));
}

void RavenController::set_encoder_offset(JointSlot slot, std::int64_t counts) {
  state_.encoder_offset[static_cast<std::size_t>(slot)] = counts;
}

void RavenController::read_sensors(const SlotCounts& encoder_counts) {
  state_.encoder_counts = encoder_counts;
  const SlotVector before = state_.mpos_rad;
  for (std::size_t slot = 0; slot < core::kSlotCount; ++slot) {
    state_.mpos_rad[slot] = radians(slot, encoder_counts[slot]);
    state_.mvel_rad_per_s[slot] =
        first_reading_ ? 0.0 : (state_.mpos_rad[slot] - before[slot]) / cycle_s_;
  }
  first_reading_ = false;
  const Vector3d joints =
      joints_from_motors(*plant_, {state_.mpos_rad[0], state_.mpos_rad[1], state_.mpos_rad[2]});
  for (std::size_t i = 0; i < 3; ++i) state_.jpos_ji[i] = joints[static_cast<Index>(i)];
  tool_joints_from_motors(arm_, state_.mpos_rad, state_.jpos_ji);
  find_joint_velocities();
}

/// The coupling is linear and has no constant part: velocities go through it as positions do.
void RavenController::find_joint_velocities() {
  const SlotVector& motors = state_.mvel_rad_per_s;
  if (!plant_->robot.controller.couples_velocities) {
    for (std::size_t i = 0; i < 3; ++i) state_.jvel_ji[i] = motors[i] / plant_->joints[i].reduction;
    return;
  }
  const Vector3d joints = joints_from_motors(*plant_, {motors[0], motors[1], motors[2]});
  for (std::size_t i = 0; i < 3; ++i) state_.jvel_ji[i] = joints[static_cast<Index>(i)];
  tool_joints_from_motors(arm_, motors, state_.jvel_ji);
}

void RavenController::set_desired(const Vector3d& joints_ji) {
  const Vector3d motors_rad = motors_from_joints(*plant_, joints_ji);
  for (std::size_t i = 0; i < 3; ++i) {
    state_.mpos_d_rad[i] = motors_rad[static_cast<Index>(i)];
    state_.jpos_d_ji[i] = joints_ji[static_cast<Index>(i)];
  }
  const SlotVector tool = tool_motors_rad();
  for (const std::size_t slot : kToolIndices) state_.mpos_d_rad[slot] = tool[slot];
}

SlotVector RavenController::tool_motors_rad() const {
  SlotVector motors = state_.mpos_rad;  // the measured insertion motor, as the controller uses it
  tool_motors_from_joints(arm_, state_.jpos_d_ji, motors);
  return motors;
}

/// Torques at the gearbox outputs that carry the links' weight, zero for joints without.
Vector3d RavenController::gravity_torque_n_m() {
  const auto carried = [&](const Joint& joint) {
    return joint.controller->gravity_compensation ||
           (plant_->robot.controller.adds_gravity_torque && homed());
  };
  Vector3d torque = Vector3d::Zero();
  if (std::none_of(plant_->joints.begin(), plant_->joints.end(), carried)) return torque;
  const Vector3d weight =
      nominal_.gravity({state_.jpos_ji[0], state_.jpos_ji[1], state_.jpos_ji[2]});
  for (Index i = 0; i < 3; ++i) {
    const Joint& joint = plant_->joints[static_cast<std::size_t>(i)];
    if (carried(joint)) torque[i] = weight[i] / joint.reduction * joint.gearbox_ratio;
  }
  return torque;
}

void RavenController::servo() {
  const Vector3d gravity_n_m = gravity_torque_n_m();
  const bool limp_at_stops =
      !plant_->robot.controller.holds_at_stops && !homed() && phase_ != Phase::kMovingHome;
  for (std::size_t i = 0; i < 3; ++i) {
    const Controller& pd = *plant_->joints[i].controller;
    double torque = pd.kp_n_m_per_rad * (state_.mpos_d_rad[i] - state_.mpos_rad[i]) -
                    pd.kd_n_m_s_per_rad * state_.mvel_rad_per_s[i] +
                    gravity_n_m[static_cast<Index>(i)];
    if (limp_at_stops && at_stop_[i]) torque = 0.0;
    set_torque(i, torque);
  }
  servo_tool();
}

void RavenController::set_torque(std::size_t joint, double torque_n_m) {
  const Joint& axis = plant_->joints[joint];
  state_.tau_n_m[joint] = torque_n_m;
  state_.dac[joint] =
      dac_counts(torque_n_m, axis.drive.dac_counts_per_n_m, axis.controller->dac_limit_counts);
}

void RavenController::rest(const Vector3d& desired_ji, bool pedal_up) {
  finish_cycle();
  set_desired(desired_ji);
  state_.tau_n_m = {};
  state_.dac = {};
  if (!pedal_up || !plant_->robot.controller.adds_gravity_torque) return;
  const Vector3d gravity_n_m = gravity_torque_n_m();
  for (std::size_t i = 0; i < 3; ++i) set_torque(i, gravity_n_m[static_cast<Index>(i)]);
}

void RavenController::servo_tool() {
  for (const std::size_t slot : kToolIndices) {
    state_.tau_n_m[slot] = kToolKp[slot] * (state_.mpos_d_rad[slot] - state_.mpos_rad[slot]) -
                           kToolKd[slot] * state_.mvel_rad_per_s[slot];
    state_.dac[slot] =
        dac_counts(state_.tau_n_m[slot], kToolDacPerTorque * tool_flip(slot), kToolDacLimit[slot]);
  }
}

void RavenController::finish_cycle() {
  state_.pose = forward_kinematics(arm_, state_.jpos_ji);
  state_.jacobian_velocity = placeholder_jacobian_velocity(state_.jpos_ji, state_.jvel_ji);
}

void RavenController::control(const Vector3d& desired_ji) {
  finish_cycle();
  set_desired(desired_ji);
  servo();
}

void RavenController::start_homing() {
  phase_ = Phase::kSeeking;
  phase_time_s_ = 0.0;
  at_stop_ = {};
  for (std::size_t i = 0; i < 3; ++i) {
    state_.encoder_offset[i] =
        static_cast<std::int64_t>(encoder_sign(i) * static_cast<double>(state_.encoder_counts[i]));
  }
  read_sensors(state_.encoder_counts);
  for (std::size_t i = 0; i < 3; ++i) {
    state_.mvel_rad_per_s[i] = state_.jvel_ji[i] = 0.0;
    target_ji_[static_cast<Index>(i)] = state_.jpos_ji[i];
  }
}

void RavenController::set_joints_known() {
  Vector3d stops;
  for (std::size_t i = 0; i < 3; ++i) {
    stops[static_cast<Index>(i)] = plant_->joints[i].homing->stop_controller_ji;
  }
  set_desired(stops);
  const double counts_per_rad = plant_->sensors.motor_encoder_counts_per_rev / core::kRadPerTurn;
  for (std::size_t i = 0; i < 3; ++i) {
    const double counts = encoder_sign(i) * static_cast<double>(state_.encoder_counts[i]);
    state_.encoder_offset[i] =
        static_cast<std::int64_t>(counts - state_.mpos_d_rad[i] * counts_per_rad);
  }
  first_reading_ = true;
  read_sensors(state_.encoder_counts);
  target_ji_ = stops;
}

void RavenController::seek_stops() {
  const double ramp = std::min(1.0, phase_time_s_ / kHomingRampS);
  for (std::size_t i = 0; i < 3; ++i) {
    const Homing& homing = *plant_->joints[i].homing;
    if (std::abs(state_.dac[i]) >= homing.dac_threshold_counts) at_stop_[i] = true;
    if (!at_stop_[i]) target_ji_[static_cast<Index>(i)] += homing.speed_ji * ramp * cycle_s_;
  }
  if (at_stop_[0] && at_stop_[1] && at_stop_[2]) {
    phase_ = Phase::kSettling;
    phase_time_s_ = 0.0;
  }
}

/// The command that shows a stop is not sent; from then on the joint is wanted where it is.
void RavenController::hold_at_stops() {
  for (std::size_t i = 0; i < 3; ++i) {
    if (at_stop_[i] || std::abs(state_.dac[i]) < plant_->joints[i].homing->dac_threshold_counts)
      continue;
    at_stop_[i] = true;
    target_ji_[static_cast<Index>(i)] = state_.jpos_d_ji[i] = state_.jpos_ji[i];
    state_.tau_n_m[i] = state_.dac[i] = 0.0;
  }
}

bool RavenController::home_step() {
  phase_time_s_ += cycle_s_;
  if (phase_ == Phase::kSeeking) {
    seek_stops();
  } else if (phase_ == Phase::kSettling && phase_time_s_ >= kHomingSettleS) {
    set_joints_known();
    move_start_ji_ = target_ji_;
    phase_ = Phase::kMovingHome;
    phase_time_s_ = 0.0;
  } else if (phase_ == Phase::kMovingHome) {
    const double share = std::min(1.0, phase_time_s_ / plant_->robot.controller.home_time_s);
    const double blend = 0.5 * (1.0 - std::cos(std::numbers::pi * share));
    for (std::size_t i = 0; i < 3; ++i) {
      const auto n = static_cast<Index>(i);
      target_ji_[n] =
          move_start_ji_[n] + blend * (plant_->joints[i].homing->home_ji - move_start_ji_[n]);
    }
    if (share >= 1.0) phase_ = Phase::kHomed;
  }
  control(target_ji_);
  if (phase_ == Phase::kSeeking && plant_->robot.controller.holds_at_stops) hold_at_stops();
  return homed();
}

Vector3d RavenController::commanded_torque_n_m() const {
  Vector3d torque;
  for (std::size_t i = 0; i < 3; ++i) {
    torque[static_cast<Index>(i)] = state_.dac[i] / plant_->joints[i].drive.dac_counts_per_n_m;
  }
  return torque;
}

}  // namespace ravencal::physics
