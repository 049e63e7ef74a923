// SPDX-License-Identifier: Apache-2.0
#include "physics/arm_physics.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "physics/arm_dynamics.hpp"
#include "physics/cable.hpp"
#include "physics/effects/bristle_friction.hpp"
#include "physics/plant_effort.hpp"

namespace ravencal::physics {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Friction with a level that wanders about its mean.
struct Friction {
  BristleFriction bristle;
  Wander variation;
  double level = 0.0;
  double load_share = 0.0;
  double level_difference = 0.0;  ///< forwards beyond backwards

  double step(double velocity, double dt_s, double load = 0.0) {
    if (level <= 0.0) return 0.0;
    const double scale =
        std::max(0.1, 1.0 + variation.value()) * (1.0 + load_share * std::abs(load) / level);
    const double friction = bristle.step(velocity, dt_s, scale);
    return friction + 0.5 * level_difference * std::min(1.0, std::abs(friction) / level);
  }
};

Wander variation_of(const Joint& joint, std::string_view effect) {
  return {joint.parameter(effect, "variation"),
          std::max(1e-3, joint.parameter(effect, "variation_time"))};
}

Friction motor_friction(const Joint& joint) {
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
    p.presliding = joint.kind == JointKind::kRevolute ? 1e-4 : 1e-5;
  }
  return {BristleFriction(p), variation_of(joint, "coulomb_friction"), p.level, load_share,
          joint.parameter("asymmetric_friction", "level_difference")};
}

Friction joint_friction(const Joint& joint) {
  BristleFriction::Parameters p;
  p.level = joint.parameter("joint_friction", "level");
  p.presliding = std::max(1e-9, joint.parameter("joint_friction", "presliding"));
  p.damping = joint.parameter("joint_friction", "damping");
  return {BristleFriction(p), variation_of(joint, "joint_friction"), p.level,
          joint.parameter("joint_friction", "load_share")};
}

/// One-sided contact with the mechanical end of the joint's range.
struct HardStop {
  double direction = 0.0;  ///< sign of the motion that runs into it; 0: none
  double position = 0.0;
  double offset = 0.0;  ///< of every seat
  double seat = 0.0;    ///< how far this homing's seat is off
  double deviation = 0.0;
  double stiffness = 0.0;
  double damping = 0.0;

  [[nodiscard]] double effort(double joint, double velocity) const {
    const double depth = direction * (joint - position - seat);
    if (direction == 0.0 || depth <= 0.0) return 0.0;
    return -direction * std::max(0.0, stiffness * depth + damping * direction * velocity);
  }
};

HardStop hard_stop(const Joint& joint) {
  HardStop stop;
  if (!joint.homing) return stop;
  stop.direction = joint.homing->speed_ji > 0.0 ? 1.0 : -1.0;
  stop.position = joint.homing->stop_encoder_ji;
  stop.deviation = joint.parameter("homing_offset", "deviation");
  stop.offset = joint.parameter("homing_offset", "offset");
  stop.stiffness = joint.homing->stop_stiffness;
  stop.damping = joint.homing->stop_damping;
  return stop;
}

/// Where a cable without stretch holds each joint: `of_motor` times motor angles over nominal
/// reduction, the controller's coupling and ratio with the plant's errors on top, and `of_joint`
/// times the joints whose links cables follow. By virtual work tensions act on both through the
/// transposes.
struct Drives {
  Matrix3d of_motor, of_joint;
};

Drives true_drives(const Plant& plant) {
  Matrix3d through_drive = Matrix3d::Zero();
  Matrix3d through_link = Matrix3d::Zero();
  Vector3d gain;
  for (Index i = 0; i < 3; ++i) {
    const auto row = static_cast<std::size_t>(i);
    const Joint& joint = plant.joints[row];
    gain[i] = 1.0 + joint.parameter("gain_error", "ratio");
    Matrix3d& coupling = joint.coupling_through == Through::kLink ? through_link : through_drive;
    for (Index k = 0; k < 3; ++k)
      coupling(i, k) = coupling_of(plant, row, static_cast<std::size_t>(k));
  }
  const Matrix3d driven = (Matrix3d::Identity() - through_drive).inverse();
  return {driven * gain.asDiagonal(), driven * through_link};
}

}  // namespace

struct ArmPhysics::Impl {
  Impl(const Plant& plant, std::vector<Cable> cables_in, bool drift)
      : cables(std::move(cables_in)),
        dynamics(plant, plant.robot.arm == "green" ? Arm::kGreen : Arm::kGold, true),
        drives(true_drives(plant)),
        cycle_s(1.0 / plant.robot.control_rate_hz),
        inner_steps(static_cast<int>(plant.robot.inner_rate_hz / plant.robot.control_rate_hz)),
        with_drift(drift) {
    for (Index i = 0; i < 3; ++i) {
      const Joint& axis = plant.joints[static_cast<std::size_t>(i)];
      reduction[i] = axis.reduction;
      inertia[i] = axis.motor_inertia_kg_m2 * axis.reduction * axis.reduction;
      const double drive_gain = 1.0 + axis.parameter("torque_constant", "ratio");
      effort_per_torque[i] = axis.reduction / axis.gearbox_ratio * drive_gain;
      lost_effort[i] = drive_gain * axis.parameter("effort_offset", "offset");
      viscous[i] = axis.parameter("viscous_friction", "damping");
      asymmetry[i] = 0.5 * axis.parameter("asymmetric_friction", "damping_difference");
      ripple[i] = axis.parameter("torque_ripple", "amplitude");
      ripple_order[i] = axis.parameter("torque_ripple", "order");
      ripple_phase[i] = axis.parameter("torque_ripple", "phase");
      const double limit = axis.parameter("saturation", "limit");
      effort_limit[i] = limit > 0.0 ? limit : std::numeric_limits<double>::infinity();
      motor_frictions.push_back(motor_friction(axis));
      joint_frictions.push_back(joint_friction(axis));
      stops.push_back(hard_stop(axis));
    }
  }

  void advance_slow(RandomSource& random) {
    age_s += cycle_s;
    for (std::size_t i = 0; i < 3; ++i) {
      cables[i].advance_length(cycle_s, age_s, with_drift, random);
      motor_frictions[i].variation.step(cycle_s, random);
      joint_frictions[i].variation.step(cycle_s, random);
    }
    inverse_mass = dynamics.mass_matrix(joint).inverse();
    bias = dynamics.gravity(joint) + dynamics.coriolis(joint, joint_velocity);
  }

  /// Semi-implicit Euler: velocities from efforts at the old positions, then positions.
  void inner_step(const Vector3d& drive_effort, double dt_s) {
    const Vector3d drive = drives.of_motor * motor + drives.of_joint * joint;
    const Vector3d drive_velocity =
        drives.of_motor * motor_velocity + drives.of_joint * joint_velocity;
    Vector3d tension;
    Vector3d joint_effort;
    for (Index i = 0; i < 3; ++i) {
      const auto n = static_cast<std::size_t>(i);
      tension[i] = cables[n].step(cables[n].with_eccentricity(drive[i]), drive_velocity[i],
                                  joint[i], joint_velocity[i], dt_s);
      joint_effort[i] = tension[i] - bias[i] -
                        joint_frictions[n].step(joint_velocity[i], dt_s, tension[i]) +
                        stops[n].effort(joint[i], joint_velocity[i]);
    }
    joint_effort -= drives.of_joint.transpose() * tension;
    const Vector3d reaction = drives.of_motor.transpose() * tension;
    for (Index i = 0; i < 3; ++i) {
      const auto n = static_cast<std::size_t>(i);
      double friction = motor_frictions[n].step(motor_velocity[i], dt_s, tension[i]) +
                        viscous[i] * motor_velocity[i] + asymmetry[i] * std::abs(motor_velocity[i]);
      if (ripple[i] != 0.0)
        friction += ripple[i] * std::sin(ripple_order[i] * motor[i] + ripple_phase[i]);
      const double effort = std::clamp(drive_effort[i], -effort_limit[i], effort_limit[i]);
      motor_velocity[i] += dt_s * (effort - friction - reaction[i]) / inertia[i];
    }
    joint_velocity += dt_s * (inverse_mass * joint_effort);
    motor += dt_s * motor_velocity;
    joint += dt_s * joint_velocity;
  }

  std::vector<Cable> cables;
  std::vector<Friction> motor_frictions;
  std::vector<Friction> joint_frictions;
  std::vector<HardStop> stops;
  ArmDynamics dynamics;
  Drives drives;
  Vector3d reduction;
  Vector3d inertia;            // of motor and gearbox, at the joint
  Vector3d effort_per_torque;  // joint effort per torque at the gearbox output
  Vector3d lost_effort;        // constant part of the effort asked that moves nothing
  Vector3d viscous;
  Vector3d asymmetry;     // half the difference of damping between the directions
  Vector3d ripple;        // against the motion of the motor, over its position at the joint
  Vector3d ripple_order;  // per joint unit
  Vector3d ripple_phase;
  Vector3d effort_limit;  // of the drives, at the joint
  double cycle_s;
  int inner_steps;
  bool with_drift;

  Vector3d motor = Vector3d::Zero();  // motor angle over nominal reduction: joint units
  Vector3d motor_velocity = Vector3d::Zero();
  Vector3d joint = Vector3d::Zero();
  Vector3d joint_velocity = Vector3d::Zero();
  Vector3d motors_rad = Vector3d::Zero();
  Matrix3d inverse_mass = Matrix3d::Identity();
  Vector3d bias = Vector3d::Zero();
  double age_s = 0.0;
};

core::Result<ArmPhysics> ArmPhysics::create(const Plant& plant, bool with_drift) {
  if (plant.joints.size() != 3) {
    return core::Error{core::ErrorCode::kData,
                       fmt::format("{}: the RAVEN twin needs 3 joints, found {}", plant.source,
                                   plant.joints.size())};
  }
  std::vector<Cable> cables;
  for (const Joint& joint : plant.joints) {
    auto cable = Cable::create(joint);
    if (!cable) {
      return core::Error{cable.error().code,
                         fmt::format("{}: {}", plant.source, cable.error().message)};
    }
    cables.push_back(std::move(cable).value());
  }
  return ArmPhysics(std::make_unique<Impl>(plant, std::move(cables), with_drift));
}

ArmPhysics::ArmPhysics(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ArmPhysics::ArmPhysics(ArmPhysics&&) noexcept = default;
ArmPhysics& ArmPhysics::operator=(ArmPhysics&&) noexcept = default;
ArmPhysics::~ArmPhysics() = default;

void ArmPhysics::place(const Vector3d& joints_ji) {
  impl_->joint = joints_ji;
  impl_->joint_velocity.setZero();
  const Drives& drives = impl_->drives;
  impl_->motor = drives.of_motor.inverse() * (joints_ji - drives.of_joint * joints_ji);
  impl_->motor_velocity.setZero();
  impl_->motors_rad = impl_->motor.cwiseProduct(impl_->reduction);
}

void ArmPhysics::draw_stop_seats(RandomSource& random) {
  for (HardStop& stop : impl_->stops) stop.seat = stop.offset + stop.deviation * random.normal();
}

void ArmPhysics::restart_disturbances(RandomSource& random) {
  for (std::size_t i = 0; i < 3; ++i) {
    impl_->cables[i].restart_wander(random);
    impl_->motor_frictions[i].variation.restart(random);
    impl_->joint_frictions[i].variation.restart(random);
  }
}

void ArmPhysics::advance(const Vector3d& torque_n_m, RandomSource& random) {
  impl_->advance_slow(random);
  const Vector3d effort = torque_n_m.cwiseProduct(impl_->effort_per_torque) - impl_->lost_effort;
  const double dt_s = impl_->cycle_s / impl_->inner_steps;
  for (int step = 0; step < impl_->inner_steps; ++step) impl_->inner_step(effort, dt_s);
  impl_->motors_rad = impl_->motor.cwiseProduct(impl_->reduction);
}

const Vector3d& ArmPhysics::motors_rad() const { return impl_->motors_rad; }
const Vector3d& ArmPhysics::joints_ji() const { return impl_->joint; }

double ArmPhysics::kinetic_energy_j() const {
  const Vector3d& v = impl_->joint_velocity;
  const Vector3d& w = impl_->motor_velocity;
  return 0.5 * v.dot(impl_->dynamics.mass_matrix(impl_->joint) * v) +
         0.5 * w.dot(impl_->inertia.cwiseProduct(w));
}

}  // namespace ravencal::physics
