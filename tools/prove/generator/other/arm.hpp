// SPDX-License-Identifier: Apache-2.0
//
// The robot by the laws of the other world (laws.hpp), integrated by symplectic Euler (Hairer,
// Lubich and Wanner, "Geometric Numerical Integration", Springer, 2006) with twenty fixed steps per
// millisecond. It shares the rigid chain, or its MuJoCo model, with the own world and nothing of
// its laws. The arm's geometry is held for a millisecond. One instance belongs to one thread.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "prove/generator/mechanics.hpp"
#include "prove/generator/mujoco_arm.hpp"
#include "prove/generator/other/laws.hpp"
#include "prove/generator/session.hpp"

namespace ravencal::prove {

class OtherArm {
 public:
  /// Errors: kData if MuJoCo refuses the chain.
  static core::Result<OtherArm> create(const RobotPhysics& robot, const OtherLaws& laws);

  /// At rest, with cables that carry the weight.
  void place(const Vector3d& joints);
  /// On by `dt_s`, a millisecond; `inputs.effort` is what the current loops are told. Errors: kData
  /// if a state is no longer finite.
  core::Status advance(const CycleInputs& inputs, double dt_s);

  /// Motor positions over nominal reduction; joint positions.
  [[nodiscard]] Vector3d motors() const { return gathered(&Joint::motor); }
  [[nodiscard]] Vector3d motor_velocities() const { return gathered(&Joint::motor_velocity); }
  [[nodiscard]] Vector3d joints() const { return gathered(&Joint::joint); }
  /// Currents that flow, as effort at the joints.
  [[nodiscard]] Vector3d currents() const { return gathered(&Joint::current); }
  /// Tension of the cables and dry friction of the motors in the last step.
  [[nodiscard]] Vector3d tensions() const { return gathered(&Joint::tension); }
  [[nodiscard]] Vector3d motor_frictions() const { return gathered(&Joint::motor_friction); }
  /// Kinetic energy of motors, links and flexible masses, and what springs hold.
  [[nodiscard]] double energy() const;

 private:
  struct Joint {
    double motor = 0.0, motor_velocity = 0.0, joint = 0.0, joint_velocity = 0.0;
    double motor_friction = 0.0, joint_friction = 0.0;
    double current = 0.0, tension = 0.0, stretch = 0.0;
    double run_out_slope = 0.0;  ///< what the cable gains per motor position
    double flexible = 0.0, flexible_velocity = 0.0;
    IwanStops strands;
    PronyCreep creep;
  };

  explicit OtherArm(const RobotPhysics& robot, const OtherLaws& laws);
  [[nodiscard]] Vector3d gathered(double Joint::*which) const;
  void step(const CycleInputs& inputs, double dt_s);
  void pull_cable(Eigen::Index i, double drive, double drive_velocity, double length, double dt_s);
  [[nodiscard]] double drive_effort(Eigen::Index i, double command, double disturbance,
                                    double dt_s);
  double bend_flexible(Eigen::Index i, double dt_s);
  void rub(Eigen::Index i, double scale, double dt_s);

  RobotPhysics robot_;
  OtherLaws laws_;
  Eigen::Matrix3d drive_from_motor_, drive_from_joint_;
  std::optional<MujocoArm> mujoco_;
  Vector3d bias_ = Vector3d::Zero();
  Eigen::Matrix3d inverse_mass_ = Eigen::Matrix3d::Identity();
  std::vector<Joint> state_;
};

}  // namespace ravencal::prove
