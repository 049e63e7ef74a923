// SPDX-License-Identifier: Apache-2.0
//
// Integrates a robot between two control cycles with SUNDIALS' adaptive explicit Runge-Kutta
// (ARKODE, ERKStep): the drive's command jumps each millisecond, and a one-step method has no
// history to rebuild. The arm's geometry is held for that millisecond.
// One instance belongs to one thread.
#pragma once

#include <array>
#include <memory>

#include "core/result.hpp"
#include "prove/generator/robot.hpp"

namespace ravencal::prove {

/// What acts on the robot during one cycle.
struct CycleInputs {
  Vector3d effort = Vector3d::Zero();          ///< of the drives, at the joints
  Vector3d disturbance = Vector3d::Zero();     ///< effort on the motors
  Vector3d length = Vector3d::Zero();          ///< cable length changes: slip, drift, wander
  Vector3d friction_scale = Vector3d::Ones();  ///< of the motors' dry friction
};

class Mechanics {
 public:
  static constexpr int kStatesPerJoint = 12;
  enum State : int {
    kMotor,
    kMotorVelocity,
    kJoint,
    kJointVelocity,
    kBristle1,
    kBristle2,
    kBristle3,
    kJointBristle,
    kLoop,
    kCreep,
    kFlexible,
    kFlexibleVelocity
  };

  /// `tolerance`: relative, of the integrator.
  static core::Result<Mechanics> create(const RobotPhysics& robot, double tolerance = 1e-6);
  Mechanics(Mechanics&&) noexcept;
  Mechanics& operator=(Mechanics&&) noexcept;
  ~Mechanics();

  /// At rest, cable unstretched but for the weight it carries.
  void place(const Vector3d& joints);
  /// On by `dt_s`. Errors: kData if the integrator gives up.
  core::Status advance(const CycleInputs& inputs, double dt_s);

  [[nodiscard]] double state(std::size_t joint, State which) const;
  /// Motor positions over nominal reduction; joint positions.
  [[nodiscard]] Vector3d motors() const;
  [[nodiscard]] Vector3d joints() const;
  /// Tension of the cables and friction of the motors at the present state.
  [[nodiscard]] Vector3d tensions() const;
  [[nodiscard]] Vector3d motor_frictions() const;
  /// Kinetic energy of motors, links and flexible masses, and what springs hold (straight cables).
  [[nodiscard]] double energy() const;

 private:
  struct Impl;
  explicit Mechanics(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace ravencal::prove
