// SPDX-License-Identifier: Apache-2.0
#include "diagnose/plant_effort.hpp"

#include <algorithm>
#include <cmath>

#include "physics/arm_dynamics.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

bool has_weight(const physics::Plant& plant) {
  double mass_kg = plant.payload.mass_kg;
  for (const physics::Joint& joint : plant.joints) mass_kg += joint.link.mass_kg;
  const auto& g = plant.robot.gravity_m_per_s2;
  return mass_kg > 0.0 && std::hypot(g[0], g[1], g[2]) > 0.0;
}

/// A pendulum about z: effort = -(r x m g)_z with r turned by q.
VectorXd pendulum_effort(const physics::Plant& plant, const VectorXd& q) {
  const physics::Link& link = plant.joints.front().link;
  const auto& g = plant.robot.gravity_m_per_s2;
  VectorXd effort(q.size());
  for (Index i = 0; i < q.size(); ++i) {
    const double x = link.com_m[0] * std::cos(q[i]) - link.com_m[1] * std::sin(q[i]);
    const double y = link.com_m[0] * std::sin(q[i]) + link.com_m[1] * std::cos(q[i]);
    effort[i] = -link.mass_kg * (x * g[1] - y * g[0]);
  }
  return effort;
}

}  // namespace

std::vector<VectorXd> holding_efforts(const physics::Plant& plant,
                                      const std::vector<VectorXd>& positions) {
  std::vector<VectorXd> efforts(positions.size());
  const bool known = std::all_of(positions.begin(), positions.end(),
                                 [](const VectorXd& q) { return q.size() > 0; });
  if (!known || !has_weight(plant)) return efforts;
  if (plant.joints.size() == 1 && plant.joints.front().kind == physics::JointKind::kRevolute) {
    efforts[0] = pendulum_effort(plant, positions[0]);
    return efforts;
  }
  if (plant.joints.size() != 3) return efforts;
  physics::ArmDynamics dynamics(
      plant, plant.robot.arm == "green" ? physics::Arm::kGreen : physics::Arm::kGold, true);
  for (VectorXd& effort : efforts) effort = VectorXd::Zero(positions.front().size());
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  for (Index i = 0; i < positions.front().size(); ++i) {
    const Eigen::Vector3d q(positions[0][i], positions[1][i], positions[2][i]);
    if (q.allFinite()) last = dynamics.gravity(q);
    for (std::size_t j = 0; j < 3; ++j) efforts[j][i] = last[static_cast<Index>(j)];
  }
  return efforts;
}

double joint_inertia(const physics::Plant& plant, std::size_t joint) {
  const physics::Joint& j = plant.joints[joint];
  const double motor = j.motor_inertia_kg_m2 * j.reduction * j.reduction;
  if (j.kind == physics::JointKind::kPrismatic) return motor + j.link.mass_kg;
  const double arm2 = j.link.com_m[0] * j.link.com_m[0] + j.link.com_m[1] * j.link.com_m[1];
  return motor + j.link.inertia_kg_m2[2] + j.link.mass_kg * arm2;
}

}  // namespace ravencal::diagnose
