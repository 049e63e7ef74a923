// SPDX-License-Identifier: Apache-2.0
#include "physics/drives.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "physics/plant_effort.hpp"

namespace ravencal::physics {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

Wander variation_of(const Joint& joint, std::string_view effect) {
  return {joint.parameter(effect, "variation"),
          std::max(1e-3, joint.parameter(effect, "variation_time"))};
}

}  // namespace

void set_reduction(Joint& joint, double motor_rad_per_joint_rad) {
  const double ratio = motor_rad_per_joint_rad;
  joint.reduction = joint.gearbox_ratio = ratio;
  joint.motor_inertia_kg_m2 =
      std::max(kNoInertia_kg_m2, joint.motor_inertia_kg_m2 / (ratio * ratio));
  if (!joint.controller) return;
  joint.controller->kp_n_m_per_rad /= ratio;
  joint.controller->kd_n_m_s_per_rad /= ratio;
}

DriveKinematics drive_kinematics(const Plant& plant,
                                 const std::vector<std::optional<double>>& link_shares) {
  const auto joints = static_cast<Index>(plant.joints.size());
  MatrixXd through_drive = MatrixXd::Zero(joints, joints);
  MatrixXd through_link = MatrixXd::Zero(joints, joints);
  VectorXd gain(joints);
  for (Index i = 0; i < joints; ++i) {
    const auto row = static_cast<std::size_t>(i);
    const Joint& joint = plant.joints[row];
    gain[i] = 1.0 + joint.parameter("gain_error", "ratio");
    const double by_plant = joint.coupling_through == Through::kLink ? 1.0 : 0.0;
    const double link_share = link_shares.empty() ? by_plant : link_shares[row].value_or(by_plant);
    for (Index k = 0; k < joints; ++k) {
      const double factor = coupling_of(plant, row, static_cast<std::size_t>(k));
      through_link(i, k) = link_share * factor;
      through_drive(i, k) = (1.0 - link_share) * factor;
    }
  }
  const MatrixXd driven = (MatrixXd::Identity(joints, joints) - through_drive).inverse();
  return {driven * gain.asDiagonal(), driven * through_link};
}

VectorXd DriveKinematics::motors_of(const VectorXd& joints_ji) const {
  return of_motor.inverse() * (joints_ji - of_joint * joints_ji);
}

VectorXd homed_constants(const Plant& plant, const DriveKinematics& kinematics) {
  const auto joints = static_cast<Index>(plant.joints.size());
  VectorXd believed = VectorXd::Zero(joints);
  VectorXd shown = VectorXd::Zero(joints);
  VectorXd motors = VectorXd::Zero(joints);
  for (Index j = 0; j < joints; ++j) {
    const auto row = static_cast<std::size_t>(j);
    if (const std::optional<Homing>& homing = plant.joints[row].homing) {
      believed[j] = homing->stop_controller_ji;
      shown[j] = homing->stop_encoder_ji;
    }
    motors[j] = believed[j];
    for (Index k = 0; k < j; ++k)
      motors[j] -= plant.coupling[row][static_cast<std::size_t>(k)] * believed[k];
  }
  VectorXd constants = shown - kinematics.of_motor * motors - kinematics.of_joint * shown;
  for (Index j = 0; j < joints; ++j)
    if (!plant.joints[static_cast<std::size_t>(j)].homing) constants[j] = 0.0;
  return constants;
}

double WanderingFriction::step(double velocity, double dt_s, double load) {
  if (level <= 0.0) return 0.0;
  const double by_load = load_share * std::abs(load) / level;
  const double scale = std::max(0.1, 1.0 + variation.value()) * (1.0 + by_load);
  // Where the load makes most of the friction, it makes the stiffness too: otherwise friction would
  // build up over `by_load` times the displacement.
  const double friction = bristle.step(velocity, dt_s, scale, std::max(1.0, by_load));
  return friction + 0.5 * level_difference * std::min(1.0, std::abs(friction) / level);
}

double unstated_presliding(const Joint& joint) {
  constexpr double kRevolute_rad = 1e-4;
  constexpr double kPrismatic_m = 1e-5;
  return joint.kind == JointKind::kRevolute ? kRevolute_rad : kPrismatic_m;
}

WanderingFriction motor_friction(const Joint& joint) {
  BristleFriction::Parameters p;
  // Friction that depends on the load alone still needs a bristle, so it gets a negligible level.
  const double load_share = joint.parameter("load_dependent_friction", "load_share");
  p.level = std::max(joint.parameter("coulomb_friction", "level"), load_share > 0.0 ? 1e-6 : 0.0);
  p.stribeck_extra = joint.parameter("stribeck_friction", "extra");
  p.stribeck_velocity = std::max(1e-9, joint.parameter("stribeck_friction", "velocity"));
  if (joint.find_effect("presliding") != nullptr) {
    p.presliding = joint.parameter("presliding", "displacement");
    p.damping = joint.parameter("presliding", "damping");
  } else {
    p.presliding = unstated_presliding(joint);
  }
  return {BristleFriction(p), variation_of(joint, "coulomb_friction"), p.level, load_share,
          joint.parameter("asymmetric_friction", "level_difference")};
}

WanderingFriction joint_friction(const Joint& joint) {
  BristleFriction::Parameters p;
  p.level = joint.parameter("joint_friction", "level");
  p.presliding = std::max(1e-9, joint.parameter("joint_friction", "presliding"));
  p.damping = joint.parameter("joint_friction", "damping");
  return {BristleFriction(p), variation_of(joint, "joint_friction"), p.level,
          joint.parameter("joint_friction", "load_share")};
}

DriveLosses drive_losses(const Joint& joint) {
  DriveLosses losses;
  losses.inertia = joint.motor_inertia_kg_m2 * joint.reduction * joint.reduction;
  losses.effort_ratio = 1.0 + joint.parameter("torque_constant", "ratio");
  losses.lost_effort = joint.parameter("effort_offset", "offset");
  losses.viscous = joint.parameter("viscous_friction", "damping");
  losses.asymmetry = 0.5 * joint.parameter("asymmetric_friction", "damping_difference");
  losses.ripple = joint.parameter("torque_ripple", "amplitude");
  losses.ripple_order = joint.parameter("torque_ripple", "order");
  losses.ripple_phase = joint.parameter("torque_ripple", "phase");
  losses.weight = joint.parameter("gravity", "amplitude");
  losses.weight_phase = joint.parameter("gravity", "phase");
  return losses;
}

double DriveLosses::drag(double position, double velocity) const {
  double effort = viscous * velocity + asymmetry * std::abs(velocity);
  if (ripple != 0.0) effort += ripple * std::sin(ripple_order * position + ripple_phase);
  if (weight != 0.0) effort += weight * std::sin(position + weight_phase);
  return effort;
}

}  // namespace ravencal::physics
