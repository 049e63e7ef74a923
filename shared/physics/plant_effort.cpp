// SPDX-License-Identifier: Apache-2.0
#include "physics/plant_effort.hpp"

#include <algorithm>
#include <cmath>

#include "physics/arm_dynamics.hpp"
#include "physics/rigid_bodies.hpp"

namespace ravencal::physics {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// The arm's efforts, [joints][rows]; a row whose efforts are not finite keeps those before it.
template <typename EffortAt>
std::vector<VectorXd> row_by_row(std::size_t joints, Index rows, EffortAt&& effort_at) {
  std::vector<VectorXd> efforts(joints, VectorXd::Zero(rows));
  VectorXd last = VectorXd::Zero(static_cast<Index>(joints));
  for (Index i = 0; i < rows; ++i) {
    const VectorXd effort = effort_at(i);
    if (effort.allFinite()) last = effort;
    for (std::size_t j = 0; j < joints; ++j) efforts[j][i] = last[static_cast<Index>(j)];
  }
  return efforts;
}

/// Of a plant that states its frames. The library takes whatever the reader of plants takes: it is
/// told unit masses, and axes and rotations are units.
std::vector<VectorXd> efforts_of_bodies(const Plant& plant, const std::vector<Motion>& links) {
  core::Result<RigidBodies> bodies = RigidBodies::create(plant);
  const auto count = static_cast<Index>(links.size());
  VectorXd q(count), v(count), a(count);
  return row_by_row(links.size(), links.front().q.size(), [&](Index i) -> VectorXd {
    for (Index j = 0; j < count; ++j) {
      const Motion& link = links[static_cast<std::size_t>(j)];
      q[j] = link.q[i];
      v[j] = link.v[i];
      a[j] = link.a[i];
    }
    return q.allFinite() ? bodies->efforts(q, v, a) : q;
  });
}

/// Whose geometry the closed form knows.
bool is_raven(const Plant& plant) { return plant.joints.size() == 3 && !plant.robot.arm.empty(); }

bool has_weight(const Plant& plant) {
  const auto& g = plant.robot.gravity_m_per_s2;
  return moved_mass_kg(plant) > 0.0 && std::hypot(g[0], g[1], g[2]) > 0.0;
}

/// A pendulum about z: effort = -(r x m g)_z with r turned by q.
VectorXd pendulum_effort(const Plant& plant, const VectorXd& q) {
  const Link& link = plant.joints.front().link;
  const auto& g = plant.robot.gravity_m_per_s2;
  // A payload without a place of its own hangs at the link's centre of mass.
  const auto& at = plant.payload.com_m;
  const bool placed = at[0] != 0.0 || at[1] != 0.0;
  const double mass_kg = link.mass_kg + plant.payload.mass_kg;
  const double share = mass_kg > 0.0 ? link.mass_kg / mass_kg : 1.0;
  const double com_x = placed ? share * link.com_m[0] + (1.0 - share) * at[0] : link.com_m[0];
  const double com_y = placed ? share * link.com_m[1] + (1.0 - share) * at[1] : link.com_m[1];
  VectorXd effort(q.size());
  for (Index i = 0; i < q.size(); ++i) {
    const double x = com_x * std::cos(q[i]) - com_y * std::sin(q[i]);
    const double y = com_x * std::sin(q[i]) + com_y * std::cos(q[i]);
    effort[i] = -mass_kg * (x * g[1] - y * g[0]);
  }
  return effort;
}

}  // namespace

double moved_mass_kg(const Plant& plant) {
  double mass_kg = plant.payload.mass_kg;
  for (const Joint& joint : plant.joints) mass_kg += joint.link.mass_kg;
  return mass_kg;
}

bool lacks_geometry(const Plant& plant) {
  const bool turns = plant.joints.size() == 1 && plant.joints[0].kind == JointKind::kRevolute;
  return has_weight(plant) && !has_frames(plant) && !is_raven(plant) && !turns;
}

std::vector<VectorXd> holding_efforts(const Plant& plant, const std::vector<VectorXd>& positions) {
  std::vector<VectorXd> efforts(positions.size());
  const bool known = std::all_of(positions.begin(), positions.end(),
                                 [](const VectorXd& q) { return q.size() > 0; });
  if (!known || !has_weight(plant)) return efforts;
  if (has_frames(plant)) {
    std::vector<Motion> resting;
    const VectorXd none = VectorXd::Zero(positions.front().size());
    for (const VectorXd& q : positions) resting.push_back({q, none, none, 0.0});
    return efforts_of_bodies(plant, resting);
  }
  if (lacks_geometry(plant)) return efforts;
  if (!is_raven(plant)) {
    efforts[0] = pendulum_effort(plant, positions[0]);
    return efforts;
  }
  ArmDynamics dynamics(plant, plant.robot.arm == "green" ? Arm::kGreen : Arm::kGold, true);
  return row_by_row(3, positions.front().size(), [&](Index i) -> VectorXd {
    const Vector3d q(positions[0][i], positions[1][i], positions[2][i]);
    return q.allFinite() ? dynamics.gravity(q) : q;
  });
}

std::vector<VectorXd> link_efforts(const Plant& plant, const std::vector<Motion>& links) {
  const std::size_t joints = links.size();
  if (has_frames(plant)) return efforts_of_bodies(plant, links);
  if (!is_raven(plant)) {
    std::vector<VectorXd> positions;
    for (const Motion& link : links) positions.push_back(link.q);
    std::vector<VectorXd> efforts = holding_efforts(plant, positions);
    for (std::size_t j = 0; j < joints; ++j) {
      const VectorXd inertial = link_inertia(plant, j) * links[j].a;
      efforts[j] = efforts[j].size() > 0 ? VectorXd(efforts[j] + inertial) : inertial;
    }
    return efforts;
  }
  ArmDynamics dynamics(plant, plant.robot.arm == "green" ? Arm::kGreen : Arm::kGold, true);
  return row_by_row(3, links.front().q.size(), [&](Index i) -> VectorXd {
    const Vector3d q(links[0].q[i], links[1].q[i], links[2].q[i]);
    const Vector3d v(links[0].v[i], links[1].v[i], links[2].v[i]);
    const Vector3d a(links[0].a[i], links[1].a[i], links[2].a[i]);
    if (!q.allFinite()) return q;
    return dynamics.gravity(q) + dynamics.coriolis(q, v) + dynamics.mass_matrix(q) * a;
  });
}

void add_external_loads(const Plant& plant, const std::vector<VectorXd>& measured,
                        std::vector<VectorXd>& efforts) {
  for (std::size_t j = 0; j < efforts.size(); ++j)
    add_external_load(plant.joints[j], measured[j], efforts[j]);
}

void add_external_load(const Joint& joint, const VectorXd& measured, VectorXd& effort) {
  if (!joint.external_load || measured.size() == 0) return;
  if (effort.size() == 0) effort = VectorXd::Zero(measured.size());
  effort += joint.external_load->ratio * measured;
}

std::vector<VectorXd> payload_efforts_per_kg(const Plant& plant,
                                             const std::vector<VectorXd>& positions) {
  Plant loaded = plant;
  loaded.payload.mass_kg += 1.0;
  std::vector<VectorXd> efforts = holding_efforts(loaded, positions);
  const std::vector<VectorXd> without = holding_efforts(plant, positions);
  for (std::size_t j = 0; j < efforts.size(); ++j) {
    if (efforts[j].size() == 0 || without[j].size() == 0)
      efforts[j].resize(0);
    else
      efforts[j] -= without[j];
  }
  return efforts;
}

double coupling_of(const Plant& plant, std::size_t to, std::size_t from) {
  double factor = plant.coupling[to][from];
  for (const Effect& effect : plant.joints[to].effects) {
    if (effect.id == "coupling" && effect.from == plant.joints[from].name)
      factor += effect.parameters.at("error");
  }
  return factor;
}

std::vector<VectorXd> motor_efforts(const Plant& plant,
                                    const std::vector<VectorXd>& joint_efforts) {
  std::vector<VectorXd> through = joint_efforts;
  std::vector<VectorXd> motors = joint_efforts;
  for (std::size_t j = through.size(); j-- > 0;) {
    for (std::size_t k = j + 1; k < through.size(); ++k) {
      const double factor = coupling_of(plant, k, j);
      if (factor != 0.0 && through[k].size() > 0 && through[j].size() > 0)
        through[j] += factor * through[k];
    }
    motors[j] = (1.0 + plant.joints[j].parameter("gain_error", "ratio")) * through[j];
  }
  return motors;
}

std::vector<VectorXd> cable_efforts(const Plant& plant,
                                    const std::vector<VectorXd>& joint_efforts) {
  std::vector<VectorXd> cables = joint_efforts;
  for (std::size_t k = cables.size(); k-- > 0;) {
    if (plant.joints[k].coupling_through != Through::kLink || cables[k].size() == 0) continue;
    for (std::size_t j = 0; j < k; ++j) {
      const double factor = coupling_of(plant, k, j);
      if (factor != 0.0 && cables[j].size() > 0) cables[j] += factor * cables[k];
    }
  }
  return cables;
}

double link_inertia(const Plant& plant, std::size_t joint) {
  const auto place = static_cast<Index>(joint);
  if (has_frames(plant)) {
    core::Result<RigidBodies> bodies = RigidBodies::create(plant);
    const VectorXd zero = VectorXd::Zero(static_cast<Index>(plant.joints.size()));
    return bodies->mass_matrix(zero)(place, place);
  }
  const Joint& j = plant.joints[joint];
  if (j.kind == JointKind::kPrismatic) return j.link.mass_kg;
  const double arm2 = j.link.com_m[0] * j.link.com_m[0] + j.link.com_m[1] * j.link.com_m[1];
  return j.link.inertia_kg_m2[2] + j.link.mass_kg * arm2;
}

double joint_inertia(const Plant& plant, std::size_t joint) {
  const Joint& j = plant.joints[joint];
  return j.motor_inertia_kg_m2 * j.reduction * j.reduction + link_inertia(plant, joint);
}

}  // namespace ravencal::physics
