// SPDX-License-Identifier: Apache-2.0
#include "physics/drive_model.hpp"

#include <algorithm>

#include "physics/drives.hpp"

namespace ravencal::physics {

DriveNumbers<double> drive_numbers(const Joint& joint, double inertia, double least_presliding) {
  const DriveLosses losses = drive_losses(joint);
  DriveNumbers<double> n;
  n.inertia = std::max(1e-12, inertia);
  n.torque_ratio = losses.effort_ratio - 1.0;
  n.level =
      joint.parameter("coulomb_friction", "level") + joint.parameter("joint_friction", "level");
  n.load_share = joint.parameter("load_dependent_friction", "load_share");
  n.stribeck_extra = joint.parameter("stribeck_friction", "extra");
  n.stribeck_velocity = std::max(1e-9, joint.parameter("stribeck_friction", "velocity"));
  const double displacement = joint.parameter("presliding", "displacement");
  n.presliding = displacement > 0.0 ? displacement : std::max(1e-6, least_presliding);
  n.viscous = losses.viscous;
  n.asymmetry = losses.asymmetry;
  n.asymmetric_level = 0.5 * joint.parameter("asymmetric_friction", "level_difference");
  n.ripple = losses.ripple;
  n.ripple_order = losses.ripple_order;
  n.ripple_phase = losses.ripple_phase;
  n.weight = losses.weight;
  n.weight_phase = losses.weight_phase;
  n.offset = losses.lost_effort;
  return n;
}

}  // namespace ravencal::physics
