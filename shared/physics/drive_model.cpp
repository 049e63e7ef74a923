// SPDX-License-Identifier: Apache-2.0
#include "physics/drive_model.hpp"

#include <algorithm>

namespace ravencal::physics {

DriveNumbers<double> drive_numbers(const Joint& joint, double inertia, double least_presliding) {
  DriveNumbers<double> n;
  n.inertia = std::max(1e-12, inertia);
  n.torque_ratio = joint.parameter("torque_constant", "ratio");
  n.level =
      joint.parameter("coulomb_friction", "level") + joint.parameter("joint_friction", "level");
  n.load_share = joint.parameter("load_dependent_friction", "load_share");
  n.stribeck_extra = joint.parameter("stribeck_friction", "extra");
  n.stribeck_velocity = std::max(1e-9, joint.parameter("stribeck_friction", "velocity"));
  const double displacement = joint.parameter("presliding", "displacement");
  n.presliding = displacement > 0.0 ? displacement : std::max(1e-6, least_presliding);
  n.viscous = joint.parameter("viscous_friction", "damping");
  n.asymmetry = 0.5 * joint.parameter("asymmetric_friction", "damping_difference");
  n.asymmetric_level = 0.5 * joint.parameter("asymmetric_friction", "level_difference");
  n.ripple = joint.parameter("torque_ripple", "amplitude");
  n.ripple_order = joint.parameter("torque_ripple", "order");
  n.ripple_phase = joint.parameter("torque_ripple", "phase");
  n.weight = joint.parameter("gravity", "amplitude");
  n.weight_phase = joint.parameter("gravity", "phase");
  n.offset = joint.parameter("effort_offset", "offset");
  return n;
}

}  // namespace ravencal::physics
