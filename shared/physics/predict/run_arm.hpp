// SPDX-License-Identifier: Apache-2.0
//
// All drives of a plant together: each under its servo, against friction (drive_model.hpp), and one
// on the other through the links. Links move as their motors do without stretch; what stands
// between them is for predict() to say. Units of the joints; motor positions are motor angles over
// the nominal reduction.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "core/result.hpp"
#include "physics/plant.hpp"
#include "physics/servo_law.hpp"

namespace ravencal::physics {

/// What closes a joint's loop.
struct ArmServo {
  ServoLaw law;
  bool holds_weight = false;  ///< adds the effort that holds the links where they are
};

class ArmRun {
 public:
  /// `servos`: [joints]. Errors (kData): bodies that libmujoco refuses.
  static core::Result<ArmRun> create(const Plant& plant, std::vector<ArmServo> servos);
  ArmRun(ArmRun&&) noexcept;
  ArmRun& operator=(ArmRun&&) noexcept;
  ~ArmRun();

  /// At rest.
  void place(const Eigen::VectorXd& motors_ji);
  /// One control cycle, along which the desired motor positions move from `from` to `to`.
  void advance(const Eigen::VectorXd& from, const Eigen::VectorXd& to);

  [[nodiscard]] const Eigen::VectorXd& motors_ji() const;  ///< now
  /// Of the last cycle, where it began: as the servos saw it, and what they asked for (N m or N at
  /// the joint).
  [[nodiscard]] const Eigen::VectorXd& velocities_ji() const;
  [[nodiscard]] const Eigen::VectorXd& efforts() const;
  /// Of motors and links at the motors' positions: [joints][joints].
  [[nodiscard]] const Eigen::MatrixXd& inertia() const;

 private:
  struct Impl;
  explicit ArmRun(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Motor positions that a controller asks for where it wants the joints there: by the plant's
/// coupling, which its errors are no part of.
Eigen::VectorXd asked_motors(const Plant& plant, const Eigen::VectorXd& joints_ji);
/// Where that controller takes the joints to be.
Eigen::VectorXd believed_joints(const Plant& plant, const Eigen::VectorXd& motors_ji);

}  // namespace ravencal::physics
