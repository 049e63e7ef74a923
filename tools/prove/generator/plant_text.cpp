// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "prove/generator/subject.hpp"

namespace ravencal::prove {
namespace {

std::string list(const Vector3d& v) {
  return fmt::format("[{:.9g}, {:.9g}, {:.9g}]", v[0], v[1], v[2]);
}

std::string joint_text(const NominalJoint& j, bool says_way, bool states_controller) {
  const bool p = j.prismatic;
  std::string text = fmt::format(
      "\n[[joint]]\nname = \"{}\"\nkind = \"{}\"\nmotor_inertia_kg_m2 = {:.9g}\n"
      "gearbox_ratio = {:.9g}\n{} = {:.12g}\n{} = {:.9g}\n",
      j.name, p ? "prismatic" : "revolute", j.motor_inertia_kg_m2, j.gearbox_ratio,
      p ? "reduction_rad_per_m" : "reduction", j.reduction,
      p ? "joint_encoder_resolution_m" : "joint_encoder_resolution_rad", j.truth_resolution);
  if (says_way)
    text += fmt::format("coupling_through = \"{}\"\n", j.follows_links ? "link" : "drive");
  text += fmt::format("\n  [joint.link]\n  mass_kg = {:.9g}\n  com_m = {}\n  inertia_kg_m2 = {}\n",
                      j.mass_kg, list(j.com_m), list(j.inertia_kg_m2));
  text +=
      fmt::format("\n  [joint.drive]\n  input = \"torque_n_m\"\n  dac_counts_per_n_m = {:.9g}\n",
                  j.dac_counts_per_n_m);
  if (states_controller) {
    text += fmt::format(
        "\n  [joint.controller]\n  kp_n_m_per_rad = {:.9g}\n  kd_n_m_s_per_rad = {:.9g}\n"
        "  dac_limit_counts = {:.9g}\n",
        j.kp, j.kd, j.dac_limit_counts);
  }
  for (const SubjectKind& kind : vocabulary_kinds()) {
    if (!kind.stated_by(j) || kind.stated[0].rotary.empty()) continue;
    text += fmt::format("\n  [[joint.effect]]\n  id = \"{}\"\n", kind.id);
    for (const auto& [value, rotary, prismatic] : kind.stated)
      if (value != nullptr)
        text += fmt::format("  {} = {:.9g}\n", p ? prismatic : rotary, j.*value);
  }
  return text;
}

}  // namespace

std::string plant_text(const NominalRobot& robot) {
  std::string text;
  if (robot.joints.size() > 1) {
    text += "coupling = [\n";
    for (Eigen::Index i = 0; i < 3; ++i)
      text += fmt::format("  {},\n", list(robot.coupling.row(i).transpose()));
    text += "]\n\n";
  }
  text += fmt::format(
      "[robot]\nname = \"{}\"\narm = \"gold\"\ngravity_m_per_s2 = {}\n"
      "tool_joints_rad = [0.0, 0.0, 0.0, 0.0]\n\n[sensors]\nmotor_encoder_counts_per_rev = 4000\n\n"
      "[logger]\nrate_hz = {:.9g}\ntruth_period_s = {:.9g}\ntruth_latency_s = {:.9g}\n"
      "truth_latency_deviation_s = 0.0015\n",
      robot.name, list(robot.gravity), robot.row_rate_hz, robot.truth_period_s,
      robot.truth_latency_s);
  for (std::size_t i = 0; i < robot.joints.size(); ++i)
    text += joint_text(robot.joints[i], i > 0 && robot.says_ways, robot.states_controller);
  return text;
}

}  // namespace ravencal::prove
