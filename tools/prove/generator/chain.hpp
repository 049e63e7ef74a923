// SPDX-License-Identifier: Apache-2.0
//
// Rigid-body dynamics of a short serial chain, from the Jacobians of its links' centres of mass.
// The generator's own: it shares no code with shared/physics. SI units; up to three joints.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace ravencal::prove {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// One moving link. Frame after Craig: screw along x (a, alpha), then along z (theta, d).
struct ChainLink {
  double alpha_rad = 0.0;
  double a_m = 0.0;
  double theta_rad = 0.0;  ///< added to a revolute joint's angle
  double d_m = 0.0;        ///< added to a prismatic joint's length
  bool prismatic = false;
  double mass_kg = 0.0;
  Vector3d com_m = Vector3d::Zero();
  Vector3d inertia_kg_m2 = Vector3d::Zero();  ///< principal, about the centre of mass
};

/// Effort that joint motion and weight ask for: mass * a + bias.
struct ChainDynamics {
  Matrix3d mass = Matrix3d::Identity();  ///< unused rows and columns are those of the identity
  Vector3d bias = Vector3d::Zero();      ///< weight and velocity terms
};

class Chain {
 public:
  Chain() = default;
  Chain(std::vector<ChainLink> links, const Vector3d& gravity_m_per_s2)
      : links_(std::move(links)), gravity_(gravity_m_per_s2) {}

  [[nodiscard]] ChainDynamics at(const Vector3d& joints, const Vector3d& velocities) const;
  [[nodiscard]] Vector3d weight(const Vector3d& joints) const;
  [[nodiscard]] const std::vector<ChainLink>& links() const { return links_; }
  [[nodiscard]] std::vector<ChainLink>& links() { return links_; }
  [[nodiscard]] const Vector3d& gravity() const { return gravity_; }

 private:
  struct Geometry {
    std::array<Eigen::Matrix3d, 3> rotation;  ///< of each link's frame
    std::array<Vector3d, 3> axis, origin, com;
  };
  [[nodiscard]] Geometry geometry(const Vector3d& joints) const;
  [[nodiscard]] Matrix3d mass(const Geometry& g) const;
  [[nodiscard]] Vector3d weight(const Geometry& g) const;
  [[nodiscard]] Matrix3d velocity_jacobian(const Geometry& g, std::size_t link) const;

  std::vector<ChainLink> links_;
  Vector3d gravity_ = Vector3d::Zero();
};

}  // namespace ravencal::prove
