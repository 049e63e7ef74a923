// SPDX-License-Identifier: Apache-2.0
//
// The RAVEN-II controller's arithmetic (uw-biorobotics/raven2 src/raven): encoders to motor and
// joint positions, PD on the motor, DAC, homing, with the traits of the plant's ControllerBranch.
// Desired joints in. SI inside; raven_message.hpp publishes.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "physics/arm_dynamics.hpp"
#include "physics/plant.hpp"
#include "physics/raven_kinematics.hpp"

namespace ravencal::physics {

using SlotCounts = std::array<std::int64_t, core::kSlotCount>;

/// Everything of one arm that raven_state shows, in SI units and by slot.
struct ArmState {
  SlotCounts encoder_counts{};  ///< raw
  SlotCounts encoder_offset{};
  SlotVector mpos_rad{};
  SlotVector mvel_rad_per_s{};
  SlotVector jpos_ji{};
  SlotVector jvel_ji{};
  SlotVector mpos_d_rad{};
  SlotVector jpos_d_ji{};
  SlotVector tau_n_m{};  ///< commanded, at the gearbox output, before clipping
  SlotVector dac{};      ///< counts, after clipping
  ToolPose pose;
  double grasp_d_rad = 0.0;
  std::array<double, 6> jacobian_velocity{};
  int type = 0;  ///< USB serial of the arm's board
};

/// Joints 1 to 3 that the controller believes in, from its motor angles, and back: nominal ratios
/// and coupling. rad to rad, rad, m.
Eigen::Vector3d joints_from_motors(const Plant& plant, const Eigen::Vector3d& motors_rad);
Eigen::Vector3d motors_from_joints(const Plant& plant, const Eigen::Vector3d& joints_ji);

class RavenController {
 public:
  RavenController(const Plant& plant, Arm arm);

  /// Takes raw encoder counts: motor and joint positions and velocities of this cycle.
  void read_sensors(const SlotCounts& encoder_counts);

  /// Runs the servo towards `desired_ji` (joints 1 to 3) and the forward kinematics.
  void control(const Eigen::Vector3d& desired_ji);

  /// A cycle with the brakes on in place of control(): no servo. With the pedal up some branches
  /// feed the motors the links' weight all the same.
  void rest(const Eigen::Vector3d& desired_ji, bool pedal_up);

  /// Power-on: forgets the zeros, so that the present counts are position 0.
  void start_homing();
  /// One cycle of the homing sequence instead of control(); true once the arm is at home.
  bool home_step();
  [[nodiscard]] bool homed() const { return phase_ == Phase::kHomed; }

  /// Motor torques that the amplifiers make of the DAC values, joints 1 to 3, N m.
  [[nodiscard]] Eigen::Vector3d commanded_torque_n_m() const;
  /// Motor angles of the tool joints that follow the insertion motor, for the kinematic joints.
  [[nodiscard]] SlotVector tool_motors_rad() const;
  [[nodiscard]] const ArmState& state() const { return state_; }
  /// Offset of a slot that no motor drives (void) or that homing sets elsewhere (tool).
  void set_encoder_offset(core::JointSlot slot, std::int64_t counts);

  /// Encoder sign of a slot: arms 1 to 3 from the plant, tool joints negative (RAVEN tools).
  [[nodiscard]] double encoder_sign(std::size_t slot) const;

 private:
  enum class Phase { kSeeking, kSettling, kMovingHome, kHomed };

  void find_joint_velocities();
  [[nodiscard]] Eigen::Vector3d gravity_torque_n_m();
  void set_torque(std::size_t joint, double torque_n_m);
  void seek_stops();
  void hold_at_stops();
  void servo();
  void servo_tool();
  void set_joints_known();
  void set_desired(const Eigen::Vector3d& joints_ji);
  void finish_cycle();
  [[nodiscard]] double radians(std::size_t slot, std::int64_t counts) const;

  const Plant* plant_;
  Arm arm_;
  ArmDynamics nominal_;
  ArmState state_;
  bool first_reading_ = true;
  Phase phase_ = Phase::kHomed;
  double phase_time_s_ = 0.0;
  double cycle_s_;
  std::array<bool, 3> at_stop_{};
  Eigen::Vector3d target_ji_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d move_start_ji_ = Eigen::Vector3d::Zero();
};

}  // namespace ravencal::physics
