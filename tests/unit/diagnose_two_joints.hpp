// SPDX-License-Identifier: Apache-2.0
//
// Two joints, the motor of the first of which winds the second one's cable as well.
#pragma once

#include <string>

#include "physics/plant.hpp"

namespace ravencal::generator {

/// Joint two follows half of joint one, backwards.
inline constexpr double kTwoJointCoupling = -0.5;
inline constexpr double kTwoJointReduction = 100.0;

/// Either joint with 1.5 N m of Coulomb friction at its drive and what `more` adds to its table.
inline physics::Plant two_joints(const std::string& more) {
  std::string text =
      "coupling = [[0, 0], [-0.5, 0]]\n\n[robot]\nname = \"two\"\n"
      "gravity_m_per_s2 = [0.0, 0.0, 0.0]\ntool_joints_rad = [0.0, 0.0, 0.0, 0.0]\n";
  for (const char* name : {"one", "two"}) {
    text += std::string("\n[[joint]]\nname = \"") + name +
            "\"\nkind = \"revolute\"\nmotor_inertia_kg_m2 = 2.3e-5\ngearbox_ratio = 1.0\n"
            "reduction = 100.0\njoint_encoder_resolution_rad = 1e-5\n\n"
            "  [joint.drive]\n  input = \"torque_n_m\"\n  dac_counts_per_n_m = -3695.81\n\n" +
            more + "\n  [[joint.effect]]\n  id = \"coulomb_friction\"\n  level_n_m = 1.5\n";
  }
  return physics::parse_plant(text, "test").value();
}

}  // namespace ravencal::generator
