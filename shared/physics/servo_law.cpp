// SPDX-License-Identifier: Apache-2.0
#include "physics/servo_law.hpp"

#include <cmath>

namespace ravencal::physics {

std::optional<ServoLaw> servo_law(const Joint& joint) {
  if (!joint.controller) return std::nullopt;
  const double to_joint = joint.reduction / joint.gearbox_ratio;
  const double counts = std::abs(joint.drive.dac_counts_per_n_m);
  ServoLaw law;
  law.position = joint.controller->kp_n_m_per_rad * joint.reduction * to_joint;
  law.rate = joint.controller->kd_n_m_s_per_rad * joint.reduction * to_joint;
  if (counts > 0.0) law.limit = joint.controller->dac_limit_counts / counts * to_joint;
  return law;
}

}  // namespace ravencal::physics
