// SPDX-License-Identifier: Apache-2.0
//
// Rigid-body dynamics of joints 1 to 3 with the payload (orocos-kdl): mass matrix, centrifugal and
// Coriolis efforts, weight. Evaluated once per control cycle; the arm moves at some degrees per
// second, so a 1 ms old mass matrix is off by less than 1e-4 of itself.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>

#include "physics/plant.hpp"
#include "physics/raven_kinematics.hpp"

namespace ravencal::physics {

class ArmDynamics {
 public:
  /// Joints 0 to 2 of the plant give the links. Throws nothing; the plant must have three joints.
  ArmDynamics(const Plant& plant, Arm arm, bool with_payload);
  ArmDynamics(ArmDynamics&&) noexcept;
  ArmDynamics& operator=(ArmDynamics&&) noexcept;
  ArmDynamics(const ArmDynamics&) = delete;
  ArmDynamics& operator=(const ArmDynamics&) = delete;
  ~ArmDynamics();

  /// Mass matrix, mixed joint units (kg m^2, kg m, kg).
  Eigen::Matrix3d mass_matrix(const Eigen::Vector3d& joints_ji);
  /// Efforts that hold the arm against its weight: N m, N m, N.
  Eigen::Vector3d gravity(const Eigen::Vector3d& joints_ji);
  /// Centrifugal and Coriolis efforts: N m, N m, N.
  Eigen::Vector3d coriolis(const Eigen::Vector3d& joints_ji, const Eigen::Vector3d& velocities_ji);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ravencal::physics
