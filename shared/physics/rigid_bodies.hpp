// SPDX-License-Identifier: Apache-2.0
//
// Rigid-body dynamics of any tree of joints whose plant states their frames (Joint::frame), by
// libmujoco: composite inertias and the recursive Newton-Euler algorithm. RAVEN arms state no
// frames; theirs is ArmDynamics.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "core/result.hpp"
#include "physics/plant.hpp"

namespace ravencal::physics {

/// One instance belongs to one thread.
class RigidBodies {
 public:
  /// Errors (kData): the library refuses the bodies, with its reason.
  static core::Result<RigidBodies> create(const Plant& plant);
  RigidBodies(RigidBodies&&) noexcept;
  RigidBodies& operator=(RigidBodies&&) noexcept;
  ~RigidBodies();

  /// Efforts that move the links so: weight, centrifugal, Coriolis and inertial. [joints], in the
  /// joints' units.
  Eigen::VectorXd efforts(const Eigen::VectorXd& positions_ji, const Eigen::VectorXd& velocities_ji,
                          const Eigen::VectorXd& accelerations_ji);
  /// What each of inertial_numbers() adds to those efforts, which are linear in them:
  /// [joints][kInertialNumbers * joints].
  Eigen::MatrixXd efforts_per_number(const Eigen::VectorXd& positions_ji,
                                     const Eigen::VectorXd& velocities_ji,
                                     const Eigen::VectorXd& accelerations_ji);
  /// Of the links, without motors: [joints][joints].
  Eigen::MatrixXd mass_matrix(const Eigen::VectorXd& positions_ji);

 private:
  struct Impl;
  explicit RigidBodies(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// True if the plant's joints state where they are.
bool has_frames(const Plant& plant);

/// Of one link: mass, first moment (x, y, z) and second moments (xx, yy, zz, xy, xz, yz) about the
/// origin of its frame.
inline constexpr Eigen::Index kInertialNumbers = 10;
/// Of all links in the order of their joints, the payload as a part of the last one.
Eigen::VectorXd inertial_numbers(const Plant& plant);

}  // namespace ravencal::physics
