// SPDX-License-Identifier: Apache-2.0
#include "physics/robot_model/series_joints.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace ravencal::physics {
namespace {

/// Of units and metres: what a file's decimals leave.
constexpr double kSamePlace = 1e-6;

bool same(const mjtNum* values, int one, int other) {
  const mjtNum* a = values + 3 * static_cast<std::ptrdiff_t>(one);
  const mjtNum* b = values + 3 * static_cast<std::ptrdiff_t>(other);
  return std::equal(a, a + 3, b, [](mjtNum x, mjtNum y) { return std::abs(x - y) <= kSamePlace; });
}

bool is_driven(const mjModel& m, int joint) {
  for (int a = 0; a < m.nu; ++a)
    if (m.actuator_trntype[a] == mjTRN_JOINT && m.actuator_trnid[2 * a] == joint) return true;
  return false;
}

bool is_of_kind(const mjModel& m, int joint, SeriesKind kind) {
  if (kind == SeriesKind::kCable)
    return m.jnt_stiffness[joint] > 0.0 && m.qpos_spring[m.jnt_qposadr[joint]] == 0.0;
  const mjtNum* range = m.jnt_range + 2 * static_cast<std::ptrdiff_t>(joint);
  return m.jnt_limited[joint] != 0 && m.jnt_stiffness[joint] == 0.0 && range[1] > 0.0 &&
         std::abs(range[0] + range[1]) <= kSamePlace * range[1];
}

}  // namespace

std::string series_name(std::string_view joint, SeriesKind kind) {
  return fmt::format("{}_{}", joint, kind == SeriesKind::kBacklash ? "backlash" : "cable");
}

std::string joint_name(const mjModel& model, int joint) {
  const char* name = mj_id2name(&model, mjOBJ_JOINT, joint);
  return name != nullptr && *name != '\0' ? std::string(name) : fmt::format("joint{}", joint);
}

std::optional<SeriesJoint> series_joint(const mjModel& m, int joint) {
  const int body = m.jnt_bodyid[joint];
  if (m.qpos0[m.jnt_qposadr[joint]] != 0.0 || is_driven(m, joint)) return std::nullopt;
  for (int of = joint - 1; of >= m.body_jntadr[body]; --of) {
    const bool alike = m.jnt_type[of] == m.jnt_type[joint] && same(m.jnt_axis, of, joint) &&
                       same(m.jnt_pos, of, joint);
    if (!alike) break;
    for (const SeriesKind kind : {SeriesKind::kBacklash, SeriesKind::kCable})
      if (joint_name(m, joint) == series_name(joint_name(m, of), kind) &&
          is_of_kind(m, joint, kind))
        return SeriesJoint{kind, of};
  }
  return std::nullopt;
}

std::vector<int> plant_joints(const mjModel& model) {
  std::vector<int> joints;
  for (int j = 0; j < model.njnt; ++j)
    if (!series_joint(model, j)) joints.push_back(j);
  return joints;
}

}  // namespace ravencal::physics
