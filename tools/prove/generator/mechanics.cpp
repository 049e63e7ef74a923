// SPDX-License-Identifier: Apache-2.0
#include "prove/generator/mechanics.hpp"

#include <arkode/arkode_erkstep.h>
#include <fmt/format.h>
#include <nvector/nvector_serial.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <sundials/sundials_context.hpp>

#include "prove/generator/mujoco_arm.hpp"

namespace ravencal::prove {

using Eigen::Index;

namespace {

double clamped(double x, double limit) { return limit > 0.0 ? std::clamp(x, -limit, limit) : x; }

/// Level at which the friction slides now.
double sliding_level(const DryFriction& f, double velocity, double position, double load,
                     double scale) {
  const double ratio = velocity / f.stribeck_velocity;
  double level = f.level + f.load_share * std::abs(load);
  if (f.stribeck_extra != 0.0) level += f.stribeck_extra * std::exp(-ratio * ratio);
  level += f.local.at(position);
  return level * scale * (1.0 + (velocity < 0.0 ? -f.asymmetry : f.asymmetry));
}

/// Slope of the bristles; their own reference, so that the slope does not change with the load.
double bristle_slope(const DryFriction& f) {
  const double reference = f.level + f.stribeck_extra + f.local.height;
  return (reference > 0.0 ? reference : f.load_share) / f.displacement;
}

struct Friction {
  double effort = 0.0;
  std::array<double, 3> rate{};
};

Friction friction_of(const DryFriction& f, const double* bristles, int elements, double velocity,
                     double level) {
  Friction result;
  const double whole = bristle_slope(f);
  if (whole <= 0.0) return result;
  // Friction that goes with a load does not vanish where the load changes sign: bristles without a
  // level would be infinitely stiff.
  level = std::max(level, 0.01 * whole * f.displacement);
  const double share = 1.0 / elements;
  for (int e = 0; e < elements; ++e) {
    const double slope = share * whole / (1.0 + f.spread * (e - (elements - 1) / 2.0));
    const double z = bristles[e];
    const double rate = velocity - slope * std::abs(velocity) / (share * level) * z;
    result.rate[static_cast<std::size_t>(e)] = rate;
    result.effort += slope * z + share * f.damping * rate;
  }
  return result;
}

struct CableState {
  double tension = 0.0;
  double loop_rate = 0.0;
  double creep_rate = 0.0;
};

double spring(const CablePhysics& c, double stretch) {
  const double bent =
      c.stiffening > 0.0 ? c.stiffening * std::sinh(stretch / c.stiffening) : stretch;
  return c.stiffness * bent;
}

/// Of a pulley on the joint's own motor: what the cable gains, and that per motor position.
double run_out(const Wave& wave, double motor) {
  return wave.amplitude * std::sin(wave.order * motor + wave.phase_rad);
}
double run_out_slope(const Wave& wave, double motor) {
  return wave.amplitude * wave.order * std::cos(wave.order * motor + wave.phase_rad);
}

CableState cable_of(const CablePhysics& c, double drive, double drive_velocity, double length,
                    const double* y) {
  const double motor = y[Mechanics::kMotor];
  const double moved = drive + length + c.bump.at(drive) + run_out(c.eccentricity, motor);
  const double moved_velocity =
      drive_velocity + run_out_slope(c.eccentricity, motor) * y[Mechanics::kMotorVelocity];
  const double elastic = moved - y[Mechanics::kJoint] - y[Mechanics::kCreep];
  const double b = c.gap_half_width;
  const double stretch = elastic > b ? elastic - b : (elastic < -b ? elastic + b : 0.0);
  const bool taut = b == 0.0 || stretch != 0.0;
  CableState s;
  const double static_part =
      spring(c, stretch) + c.hysteresis.stiffness * c.hysteresis.yield * y[Mechanics::kLoop];
  if (c.creep.compliance > 0.0)
    s.creep_rate = (c.creep.compliance * static_part - y[Mechanics::kCreep]) / c.creep.time_s;
  const double rate = taut ? moved_velocity - y[Mechanics::kJointVelocity] : 0.0;
  if (c.hysteresis.stiffness > 0.0) {
    const double h = y[Mechanics::kLoop];
    s.loop_rate = (rate - 0.5 * std::abs(rate) * h - 0.5 * rate * std::abs(h)) / c.hysteresis.yield;
  }
  s.tension = static_part + c.damping * rate;
  return s;
}

}  // namespace

struct Mechanics::Impl {
  explicit Impl(const RobotPhysics& r) : robot(r), count(static_cast<Index>(r.joints.size())) {
    Eigen::Matrix3d gain = Eigen::Matrix3d::Identity();
    Eigen::Matrix3d over_drives = r.coupling, over_links = r.coupling;
    for (Index i = 0; i < count; ++i) {
      const JointPhysics& joint = r.joints[static_cast<std::size_t>(i)];
      gain(i, i) = 1.0 + joint.cable.ratio_error;
      (joint.follows_links ? over_drives : over_links).row(i).setZero();
    }
    const Eigen::Matrix3d coupled = (Eigen::Matrix3d::Identity() - over_drives).inverse();
    drive_from_motor = coupled * gain;
    drive_from_joint = coupled * over_links;
    motor_from_drive = drive_from_motor.inverse();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (solver != nullptr) ERKStepFree(&solver);
    if (y != nullptr) N_VDestroy(y);
    if (absolute != nullptr) N_VDestroy(absolute);
  }

  [[nodiscard]] const double* of(const double* all, Index joint) const {
    return all + joint * kStatesPerJoint;
  }
  [[nodiscard]] Vector3d gathered(const double* all, State which) const {
    Vector3d out = Vector3d::Zero();
    for (Index i = 0; i < count; ++i) out[i] = of(all, i)[which];
    return out;
  }

  /// Ends of the cables at the drives, or their velocities: what motors and followed links say.
  [[nodiscard]] Vector3d drive_at(const double* all, State motor, State joint) const {
    return drive_from_motor * gathered(all, motor) + drive_from_joint * gathered(all, joint);
  }

  void derivative(const double* all, double* rate) const {
    const Vector3d drive = drive_at(all, kMotor, kJoint);
    const Vector3d drive_velocity = drive_at(all, kMotorVelocity, kJointVelocity);
    Vector3d tension = Vector3d::Zero();
    Vector3d joint_effort = Vector3d::Zero();
    for (Index i = 0; i < count; ++i) {
      const JointPhysics& joint = robot.joints[static_cast<std::size_t>(i)];
      const double* s = of(all, i);
      double* r = rate + i * kStatesPerJoint;
      const CableState cable =
          cable_of(joint.cable, drive[i], drive_velocity[i], inputs.length[i], s);
      const DryFriction& behind = joint.joint_friction;
      const Friction held =
          friction_of(behind, s + kJointBristle, 1, s[kJointVelocity],
                      sliding_level(behind, s[kJointVelocity], s[kJoint], cable.tension, 1.0));
      tension[i] = cable.tension;
      r[kMotor] = s[kMotorVelocity];
      r[kJoint] = s[kJointVelocity];
      r[kJointBristle] = held.rate[0];
      r[kLoop] = cable.loop_rate;
      r[kCreep] = cable.creep_rate;
      joint_effort[i] = cable.tension - slow.bias[i] - held.effort + flexible(joint, s, r);
    }
    // Virtual work: a cable pulls at whatever moves its end.
    joint_effort -= drive_from_joint.transpose() * tension;
    const Vector3d reaction = drive_from_motor.transpose() * tension;
    for (Index i = 0; i < count; ++i) {
      const JointPhysics& joint = robot.joints[static_cast<std::size_t>(i)];
      const double* s = of(all, i);
      double* r = rate + i * kStatesPerJoint;
      const double v = s[kMotorVelocity];
      const DryFriction& dry = joint.motor_friction;
      const Friction friction =
          friction_of(dry, s + kBristle1, 3, v,
                      sliding_level(dry, v, s[kMotor], tension[i], inputs.friction_scale[i]));
      std::copy(friction.rate.begin(), friction.rate.end(), r + kBristle1);
      const double viscous = joint.viscous * v * (1.0 + (v < 0.0 ? -1.0 : 1.0) * dry.asymmetry);
      const double leak = joint.leak.share * tension[joint.leak.from];
      r[kMotorVelocity] =
          (drive_effort(joint, i, s[kMotor]) - friction.effort - viscous - reaction[i] -
           run_out_slope(joint.cable.eccentricity, s[kMotor]) * tension[i] - leak) /
          joint.motor_inertia;
    }
    const Vector3d acceleration = inverse_mass * joint_effort;
    for (Index i = 0; i < count; ++i) rate[i * kStatesPerJoint + kJointVelocity] = acceleration[i];
  }

  [[nodiscard]] double drive_effort(const JointPhysics& joint, Index i, double motor) const {
    return clamped(inputs.effort[i], joint.saturation) * (1.0 + joint.torque_ratio) +
           joint.ripple.amplitude * std::sin(joint.ripple.order * motor + joint.ripple.phase_rad) +
           inputs.disturbance[i];
  }

  /// Effort of the flexible mass on its joint; its own motion goes into `r`.
  static double flexible(const JointPhysics& joint, const double* s, double* r) {
    r[kFlexible] = s[kFlexibleVelocity];
    r[kFlexibleVelocity] = 0.0;
    if (joint.flexible_inertia <= 0.0) return 0.0;
    const double effort = joint.flexible_stiffness * (s[kFlexible] - s[kJoint]) +
                          joint.flexible_damping * (s[kFlexibleVelocity] - s[kJointVelocity]);
    r[kFlexibleVelocity] = -effort / joint.flexible_inertia;
    return effort;
  }

  void hold_geometry() {
    const double* all = N_VGetArrayPointer(y);
    const Vector3d q = gathered(all, kJoint), v = gathered(all, kJointVelocity);
    slow = mujoco ? mujoco->at(q, v) : robot.chain.at(q, v);
    inverse_mass = slow.mass.inverse();
  }

  static int right_hand_side(realtype /*t*/, N_Vector state, N_Vector rate, void* self) {
    static_cast<const Impl*>(self)->derivative(N_VGetArrayPointer(state), N_VGetArrayPointer(rate));
    return 0;
  }

  RobotPhysics robot;
  Index count;
  Eigen::Matrix3d drive_from_motor, motor_from_drive;
  Eigen::Matrix3d drive_from_joint;  ///< of cables that follow links
  ChainDynamics slow;
  Eigen::Matrix3d inverse_mass = Eigen::Matrix3d::Identity();
  CycleInputs inputs;
  std::optional<MujocoArm> mujoco;
  sundials::Context context;
  N_Vector y = nullptr;
  N_Vector absolute = nullptr;
  void* solver = nullptr;
  double t_s = 0.0;
};

core::Result<Mechanics> Mechanics::create(const RobotPhysics& robot, double tolerance) {
  auto impl = std::make_unique<Impl>(robot);
  if (robot.mujoco) {
    RAVENCAL_ASSIGN_OR_RETURN(impl->mujoco, MujocoArm::create(robot.chain));
  }
  const sunindextype size = impl->count * kStatesPerJoint;
  impl->y = N_VNew_Serial(size, impl->context);
  impl->absolute = N_VNew_Serial(size, impl->context);
  N_VConst(0.0, impl->y);
  double* absolute = N_VGetArrayPointer(impl->absolute);
  for (Index i = 0; i < impl->count; ++i) {
    const double unit = robot.joints[static_cast<std::size_t>(i)].prismatic ? 0.1 : 1.0;
    for (int s = 0; s < kStatesPerJoint; ++s) {
      const bool velocity = s == kMotorVelocity || s == kJointVelocity || s == kFlexibleVelocity;
      absolute[i * kStatesPerJoint + s] =
          tolerance * (velocity ? 0.1 : 1e-3) * (s == kLoop ? 100.0 : unit);
    }
  }
  impl->solver = ERKStepCreate(Impl::right_hand_side, 0.0, impl->y, impl->context);
  const bool ready = impl->solver != nullptr &&
                     ERKStepSStolerances(impl->solver, tolerance, tolerance) == 0 &&
                     ERKStepSVtolerances(impl->solver, tolerance, impl->absolute) == 0 &&
                     ERKStepSetUserData(impl->solver, impl.get()) == 0 &&
                     ERKStepSetMaxNumSteps(impl->solver, 200000) == 0 &&
                     ERKStepSetTableNum(impl->solver, ARKODE_BOGACKI_SHAMPINE_4_2_3) == 0;
  if (!ready) return core::Error{core::ErrorCode::kData, "SUNDIALS refused the robot's equations"};
  return Mechanics(std::move(impl));
}

Mechanics::Mechanics(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Mechanics::Mechanics(Mechanics&&) noexcept = default;
Mechanics& Mechanics::operator=(Mechanics&&) noexcept = default;
Mechanics::~Mechanics() = default;

void Mechanics::place(const Vector3d& joints) {
  double* all = N_VGetArrayPointer(impl_->y);
  N_VConst(0.0, impl_->y);
  const Eigen::Matrix3d pulled = Eigen::Matrix3d::Identity() - impl_->drive_from_joint.transpose();
  const Vector3d tension = pulled.inverse() * impl_->robot.chain.weight(joints);
  Vector3d drive = joints;
  for (Index i = 0; i < impl_->count; ++i)
    drive[i] += tension[i] / impl_->robot.joints[static_cast<std::size_t>(i)].cable.stiffness;
  const Vector3d motors = impl_->motor_from_drive * (drive - impl_->drive_from_joint * joints);
  for (Index i = 0; i < impl_->count; ++i) {
    all[i * kStatesPerJoint + kMotor] = motors[i];
    all[i * kStatesPerJoint + kJoint] = joints[i];
    all[i * kStatesPerJoint + kFlexible] = joints[i];
  }
}

core::Status Mechanics::advance(const CycleInputs& inputs, double dt_s) {
  Impl& m = *impl_;
  m.inputs = inputs;
  m.hold_geometry();
  const double end_s = m.t_s + dt_s;
  double reached_s = m.t_s;
  int flag = ERKStepReset(m.solver, m.t_s, m.y);
  if (flag == 0) flag = ERKStepSetStopTime(m.solver, end_s);
  if (flag == 0) flag = ERKStepEvolve(m.solver, end_s, m.y, &reached_s, ARK_NORMAL);
  m.t_s = end_s;
  const bool finite = std::isfinite(N_VMaxNorm(m.y));
  if (flag >= 0 && finite) return {};
  return core::Error{
      core::ErrorCode::kData,
      fmt::format("the generator's integrator gave up at {:.3f} s (ARKODE code {})", end_s, flag)};
}

double Mechanics::state(std::size_t joint, State which) const {
  return impl_->of(N_VGetArrayPointer(impl_->y), static_cast<Index>(joint))[which];
}
Vector3d Mechanics::motors() const { return impl_->gathered(N_VGetArrayPointer(impl_->y), kMotor); }
Vector3d Mechanics::joints() const { return impl_->gathered(N_VGetArrayPointer(impl_->y), kJoint); }

Vector3d Mechanics::tensions() const {
  const double* all = N_VGetArrayPointer(impl_->y);
  const Vector3d drive = impl_->drive_at(all, kMotor, kJoint);
  const Vector3d velocity = impl_->drive_at(all, kMotorVelocity, kJointVelocity);
  Vector3d tension = Vector3d::Zero();
  for (Index i = 0; i < impl_->count; ++i) {
    tension[i] = cable_of(impl_->robot.joints[static_cast<std::size_t>(i)].cable, drive[i],
                          velocity[i], impl_->inputs.length[i], impl_->of(all, i))
                     .tension;
  }
  return tension;
}

Vector3d Mechanics::motor_frictions() const {
  const double* all = N_VGetArrayPointer(impl_->y);
  const Vector3d tension = tensions();
  Vector3d out = Vector3d::Zero();
  for (Index i = 0; i < impl_->count; ++i) {
    const JointPhysics& joint = impl_->robot.joints[static_cast<std::size_t>(i)];
    const double* s = impl_->of(all, i);
    const double v = s[kMotorVelocity];
    const double level = sliding_level(joint.motor_friction, v, s[kMotor], tension[i],
                                       impl_->inputs.friction_scale[i]);
    out[i] =
        friction_of(joint.motor_friction, s + kBristle1, 3, v, level).effort + joint.viscous * v;
  }
  return out;
}

double Mechanics::energy() const {
  const double* all = N_VGetArrayPointer(impl_->y);
  const Vector3d velocity = impl_->gathered(all, kJointVelocity);
  const Vector3d drive = impl_->drive_at(all, kMotor, kJoint);
  const ChainDynamics now = impl_->robot.chain.at(joints(), velocity);
  const auto count = impl_->count;
  double energy =
      0.5 * velocity.head(count).dot(now.mass.topLeftCorner(count, count) * velocity.head(count));
  for (Index i = 0; i < count; ++i) {
    const JointPhysics& joint = impl_->robot.joints[static_cast<std::size_t>(i)];
    const double* s = impl_->of(all, i);
    const double stretch = drive[i] + run_out(joint.cable.eccentricity, s[kMotor]) - s[kJoint];
    const double bend = s[kFlexible] - s[kJoint];
    energy += 0.5 * (joint.motor_inertia * s[kMotorVelocity] * s[kMotorVelocity] +
                     joint.cable.stiffness * stretch * stretch +
                     joint.flexible_inertia * s[kFlexibleVelocity] * s[kFlexibleVelocity] +
                     joint.flexible_stiffness * bend * bend);
  }
  return energy;
}

}  // namespace ravencal::prove
