// SPDX-License-Identifier: Apache-2.0
//
// What stands between the efforts of the drives and the tension of the cables: reductions with the
// coupling, and friction. The simulation of the arm and the prediction along a recording use the
// same. Units of the joints; motor positions are motor angles over the nominal reduction.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "physics/effects/bristle_friction.hpp"
#include "physics/effects/wander.hpp"
#include "physics/plant.hpp"

namespace ravencal::physics {

/// Where cables without stretch hold the joints: `of_motor` times motor positions (the plant's
/// coupling and gain with their errors), and `of_joint` times the joints whose links cables follow.
/// By virtual work tensions act on both through the transposes.
struct DriveKinematics {
  Eigen::MatrixXd of_motor, of_joint;  ///< [joints][joints]

  /// Motor positions that hold these joints.
  [[nodiscard]] Eigen::VectorXd motors_of(const Eigen::VectorXd& joints_ji) const;
};

/// `link_shares` ([joints], or empty): of a cable that other joints move, the share that follows
/// their links instead of their drives, where it is not for the plant to say (the plant's default:
/// drives).
DriveKinematics drive_kinematics(const Plant& plant,
                                 const std::vector<std::optional<double>>& link_shares = {});

/// Counts turns of the motor before a gearbox of this ratio, which ends at the joint: what the
/// joint feels of inertia, gains and efforts stays. `joint`: of reduction 1, as models have them.
void set_reduction(Joint& joint, double motor_rad_per_joint_rad);

/// What homing adds to the positions that `kinematics` gives for believed ones, [joints]: at its
/// stop a joint is where the external encoder has the stop, and the controller takes it for
/// elsewhere. 0 for a joint that does not home. The seat of a homing (homing_offset) comes on top.
Eigen::VectorXd homed_constants(const Plant& plant, const DriveKinematics& kinematics);

/// Dry friction whose level wanders about its mean.
struct WanderingFriction {
  BristleFriction bristle;
  Wander variation;
  double level = 0.0;             ///< N m or N; 0: none
  double load_share = 0.0;        ///< of the load, on top
  double level_difference = 0.0;  ///< forwards beyond backwards

  /// Effort against the motion, one step of `dt_s` on.
  double step(double velocity, double dt_s, double load = 0.0);
};

/// Over which dry friction of a drive builds up where the plant does not say.
double unstated_presliding(const Joint& joint);

/// Of the motor and its gearbox: coulomb_friction, stribeck_friction, presliding,
/// load_dependent_friction and asymmetric_friction.
WanderingFriction motor_friction(const Joint& joint);
/// Behind the cable: joint_friction.
WanderingFriction joint_friction(const Joint& joint);

/// What turns the effort asked of a drive into motion, dry friction apart.
struct DriveLosses {
  double inertia = 0.0;       ///< of motor and gearbox, at the joint: kg m^2 or kg
  double effort_ratio = 1.0;  ///< effort given per effort asked
  double lost_effort = 0.0;   ///< constant part of the effort asked that moves nothing
  double viscous = 0.0;       ///< effort per velocity
  double asymmetry = 0.0;     ///< half the difference of that between the directions
  double ripple = 0.0;        ///< amplitude, against the motion
  double ripple_order = 0.0;  ///< rad per joint unit
  double ripple_phase = 0.0;  ///< rad
  double weight = 0.0;        ///< of what no link states, at a joint that is level: N m
  double weight_phase = 0.0;  ///< rad

  /// Effort against the motion that depends on position and velocity alone.
  [[nodiscard]] double drag(double position, double velocity) const;
};

DriveLosses drive_losses(const Joint& joint);

}  // namespace ravencal::physics
