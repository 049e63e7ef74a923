// SPDX-License-Identifier: Apache-2.0
#include "prove/generator/chain.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace ravencal::prove {

using Eigen::Index;

Chain::Geometry Chain::geometry(const Vector3d& joints) const {
  Geometry g;
  Matrix3d rotation = Matrix3d::Identity();
  Vector3d origin = Vector3d::Zero();
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const ChainLink& link = links_[i];
    const double angle = link.theta_rad + (link.prismatic ? 0.0 : joints[static_cast<Index>(i)]);
    const double length = link.d_m + (link.prismatic ? joints[static_cast<Index>(i)] : 0.0);
    origin += rotation * Vector3d(link.a_m, 0.0, 0.0);
    rotation *= Eigen::AngleAxisd(link.alpha_rad, Vector3d::UnitX()).toRotationMatrix();
    origin += rotation * Vector3d(0.0, 0.0, length);
    rotation *= Eigen::AngleAxisd(angle, Vector3d::UnitZ()).toRotationMatrix();
    g.rotation[i] = rotation;
    g.axis[i] = rotation.col(2);
    g.origin[i] = origin;
    g.com[i] = origin + rotation * link.com_m;
  }
  return g;
}

Matrix3d Chain::velocity_jacobian(const Geometry& g, std::size_t link) const {
  Matrix3d jacobian = Matrix3d::Zero();
  for (std::size_t j = 0; j <= link; ++j) {
    jacobian.col(static_cast<Index>(j)) =
        links_[j].prismatic ? g.axis[j] : Vector3d(g.axis[j].cross(g.com[link] - g.origin[j]));
  }
  return jacobian;
}

Matrix3d Chain::mass(const Geometry& g) const {
  Matrix3d mass = Matrix3d::Zero();
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const Matrix3d linear = velocity_jacobian(g, i);
    Matrix3d angular = Matrix3d::Zero();
    for (std::size_t j = 0; j <= i; ++j) {
      if (!links_[j].prismatic) angular.col(static_cast<Index>(j)) = g.axis[j];
    }
    const Matrix3d inertia =
        g.rotation[i] * links_[i].inertia_kg_m2.asDiagonal() * g.rotation[i].transpose();
    mass +=
        links_[i].mass_kg * linear.transpose() * linear + angular.transpose() * inertia * angular;
  }
  for (auto i = static_cast<Index>(links_.size()); i < 3; ++i) mass(i, i) = 1.0;
  return mass;
}

Vector3d Chain::weight(const Geometry& g) const {
  Vector3d weight = Vector3d::Zero();
  for (std::size_t i = 0; i < links_.size(); ++i) {
    weight -= links_[i].mass_kg * velocity_jacobian(g, i).transpose() * gravity_;
  }
  return weight;
}

Vector3d Chain::weight(const Vector3d& joints) const { return weight(geometry(joints)); }

ChainDynamics Chain::at(const Vector3d& joints, const Vector3d& velocities) const {
  const Geometry here = geometry(joints);
  ChainDynamics dynamics;
  dynamics.mass = mass(here);
  dynamics.bias = weight(here);
  // Velocity terms from the mass matrix alone: dM/dt v - grad(v' M v / 2).
  constexpr double kStep = 1e-5;
  for (std::size_t k = 0; k < links_.size(); ++k) {
    Vector3d moved = joints;
    moved[static_cast<Index>(k)] += kStep;
    const Matrix3d slope = (mass(geometry(moved)) - dynamics.mass) / kStep;
    dynamics.bias += slope * velocities * velocities[static_cast<Index>(k)];
    dynamics.bias[static_cast<Index>(k)] -= 0.5 * velocities.dot(slope * velocities);
  }
  return dynamics;
}

}  // namespace ravencal::prove
