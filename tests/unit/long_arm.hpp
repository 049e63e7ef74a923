// SPDX-License-Identifier: Apache-2.0
//
// An arm of any number of joints for tests of motions: a chain whose fourth joint slides.
#pragma once

#include <fmt/format.h>

#include <string>

namespace ravencal::test {

inline constexpr int kSliding = 3;  ///< place of the joint that slides

inline std::string long_arm_joint(int place) {
  const bool slides = place == kSliding;
  const char* unit = slides ? "m" : "rad";
  std::string text =
      fmt::format("[[joint]]\nname = \"j{}\"\nkind = \"{}\"\nmotor_inertia_kg_m2 = {}\n{} = {}\n",
                  place, slides ? "prismatic" : "revolute", slides ? 1e-4 : 0.02,
                  slides ? "reduction_rad_per_m" : "reduction", slides ? 200.0 : 1.0);
  text += fmt::format("joint_encoder_resolution_{} = 1e-6\n", unit);
  text +=
      "  [joint.link]\n  mass_kg = 1.0\n  com_m = [0.1, 0.0, 0.0]\n"
      "  inertia_kg_m2 = [0.002, 0.004, 0.004]\n";
  const std::string carried =
      place > 0 ? fmt::format("  carried_by = \"j{}\"\n", place - 1) : std::string();
  text += "  [joint.frame]\n" + carried + "  position_m = [0.2, 0.0, 0.0]\n";
  text += place % 2 == 0 ? "  axis = [0.0, 0.0, 1.0]\n" : "  axis = [0.0, 1.0, 0.0]\n";
  text += fmt::format(
      "  [joint.limits]\n  low_{0} = {1}\n  high_{0} = {2}\n  speed_{0}_per_s = {3}\n", unit,
      slides ? 0.02 : -0.5 - 0.1 * place, slides ? 0.12 : 0.4 + 0.1 * place, slides ? 0.05 : 0.5);
  text += fmt::format(
      "  [joint.controller]\n  kp_n_m_per_rad = {}\n  kd_n_m_s_per_rad = {}\n"
      "  dac_limit_counts = 0.0\n",
      slides ? 0.5 : 800.0, slides ? 0.02 : 60.0);
  text += fmt::format("  [[joint.effect]]\n  id = \"viscous_friction\"\n  damping_{} = {}\n",
                      slides ? "n_s_per_m" : "n_m_s_per_rad", slides ? 20.0 : 0.5);
  return text;
}

/// The plant's file.
inline std::string long_arm(int joints) {
  std::string text = "[robot]\nname = \"long\"\ngravity_m_per_s2 = [0.0, 0.0, -9.81]\n";
  for (int place = 0; place < joints; ++place) text += long_arm_joint(place);
  return text;
}

}  // namespace ravencal::test
