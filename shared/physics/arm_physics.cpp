// SPDX-License-Identifier: Apache-2.0
#include "physics/arm_physics.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <vector>

#include "physics/arm_dynamics.hpp"
#include "physics/cable.hpp"
#include "physics/drives.hpp"

namespace ravencal::physics {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

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

}  // namespace

struct ArmPhysics::Impl {
  Impl(const Plant& plant, std::vector<Cable> cables_in, bool drift)
      : cables(std::move(cables_in)),
        dynamics(plant, plant.robot.arm == "green" ? Arm::kGreen : Arm::kGold, true),
        of_motor(drive_kinematics(plant).of_motor),
        of_joint(drive_kinematics(plant).of_joint),
        cycle_s(1.0 / plant.robot.control_rate_hz),
        inner_steps(static_cast<int>(plant.robot.inner_rate_hz / plant.robot.control_rate_hz)),
        with_drift(drift) {
    for (Index i = 0; i < 3; ++i) {
      const Joint& axis = plant.joints[static_cast<std::size_t>(i)];
      reduction[i] = axis.reduction;
      losses.push_back(drive_losses(axis));
      effort_per_torque[i] = axis.reduction / axis.gearbox_ratio * losses.back().effort_ratio;
      lost_effort[i] = losses.back().effort_ratio * losses.back().lost_effort;
      const double limit = axis.parameter("saturation", "limit");
      effort_limit[i] = limit > 0.0 ? limit : std::numeric_limits<double>::infinity();
      motor_frictions.push_back(motor_friction(axis));
      joint_frictions.push_back(joint_friction(axis));
      stops.push_back(hard_stop(axis));
    }
  }

  void advance_slow(core::Random& random) {
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
    const Vector3d drive = of_motor * motor + of_joint * joint;
    const Vector3d drive_velocity = of_motor * motor_velocity + of_joint * joint_velocity;
    Vector3d tension;
    Vector3d run_out_slope;
    Vector3d joint_effort;
    for (Index i = 0; i < 3; ++i) {
      const auto n = static_cast<std::size_t>(i);
      const Eccentricity& pulley = cables[n].eccentricity();
      run_out_slope[i] = pulley.slope(motor[i]);
      tension[i] = cables[n].step(drive[i] + pulley.at(motor[i]),
                                  drive_velocity[i] + run_out_slope[i] * motor_velocity[i],
                                  joint[i], joint_velocity[i], dt_s);
      joint_effort[i] = tension[i] - bias[i] -
                        joint_frictions[n].step(joint_velocity[i], dt_s, tension[i]) +
                        stops[n].effort(joint[i], joint_velocity[i]);
    }
    joint_effort -= of_joint.transpose() * tension;
    const Vector3d reaction = of_motor.transpose() * tension + run_out_slope.cwiseProduct(tension);
    for (Index i = 0; i < 3; ++i) {
      const auto n = static_cast<std::size_t>(i);
      const double friction = motor_frictions[n].step(motor_velocity[i], dt_s, tension[i]) +
                              losses[n].drag(motor[i], motor_velocity[i]);
      const double effort = std::clamp(drive_effort[i], -effort_limit[i], effort_limit[i]);
      motor_velocity[i] += dt_s * (effort - friction - reaction[i]) / losses[n].inertia;
    }
    joint_velocity += dt_s * (inverse_mass * joint_effort);
    motor += dt_s * motor_velocity;
    joint += dt_s * joint_velocity;
  }

  std::vector<Cable> cables;
  std::vector<WanderingFriction> motor_frictions;
  std::vector<WanderingFriction> joint_frictions;
  std::vector<DriveLosses> losses;
  std::vector<HardStop> stops;
  ArmDynamics dynamics;
  Matrix3d of_motor, of_joint;  // DriveKinematics
  Vector3d reduction;
  Vector3d effort_per_torque;  // joint effort per torque at the gearbox output
  Vector3d lost_effort;        // constant part of the effort asked that moves nothing
  Vector3d effort_limit;       // of the drives, at the joint
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
  impl_->motor = impl_->of_motor.inverse() * (joints_ji - impl_->of_joint * joints_ji);
  impl_->motor_velocity.setZero();
  impl_->motors_rad = impl_->motor.cwiseProduct(impl_->reduction);
}

void ArmPhysics::draw_stop_seats(core::Random& random) {
  for (HardStop& stop : impl_->stops) stop.seat = stop.offset + stop.deviation * random.normal();
}

void ArmPhysics::restart_disturbances(core::Random& random) {
  for (std::size_t i = 0; i < 3; ++i) {
    impl_->cables[i].restart_wander(random);
    impl_->motor_frictions[i].variation.restart(random);
    impl_->joint_frictions[i].variation.restart(random);
  }
}

void ArmPhysics::advance(const Vector3d& torque_n_m, core::Random& random) {
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
  double energy_j = 0.5 * v.dot(impl_->dynamics.mass_matrix(impl_->joint) * v);
  for (Index i = 0; i < 3; ++i)
    energy_j += 0.5 * impl_->losses[static_cast<std::size_t>(i)].inertia * w[i] * w[i];
  return energy_j;
}

}  // namespace ravencal::physics
