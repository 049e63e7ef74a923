// SPDX-License-Identifier: Apache-2.0
#include "physics/robot_model/tool_place.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "physics/robot_model/body_places.hpp"
#include "physics/robot_model/robot_file.hpp"
#include "physics/robot_model/series_joints.hpp"

namespace ravencal::physics {
namespace {

/// Names of the sites and bodies that move with a body.
std::vector<std::string> names_on(const mjModel& m, int moving) {
  std::vector<std::string> names;
  const auto add = [&](int kind, int id, int body) {
    const char* name = mj_id2name(&m, kind, id);
    if (name != nullptr && *name != '\0' && m.body_weldid[body] == m.body_weldid[moving])
      names.emplace_back(name);
  };
  for (int s = 0; s < m.nsite; ++s) add(mjOBJ_SITE, s, m.site_bodyid[s]);
  for (int b = 1; b < m.nbody; ++b) add(mjOBJ_BODY, b, b);
  return names;
}

}  // namespace

core::Status hang_payload_at(const std::string& name, const std::filesystem::path& model,
                             Plant& plant) {
  RAVENCAL_ASSIGN_OR_RETURN(const RobotFile file, read_robot_file(model));
  const mjModel& m = *file.model;
  const int site = mj_name2id(&m, mjOBJ_SITE, name.c_str());
  const int body = site >= 0 ? m.site_bodyid[site] : mj_name2id(&m, mjOBJ_BODY, name.c_str());
  const int last = m.jnt_bodyid[plant_joints(m).back()];
  if (body < 0 || m.body_weldid[body] != m.body_weldid[last])
    return core::usage_error(fmt::format(
        "--tool {}: {} has no site or body of that name on the link of its last joint "
        "{}, where a plant's payload hangs, but {}",
        name, model.string(), plant.joints.back().name, fmt::join(names_on(m, last), ", ")));
  Eigen::Vector3d at = body_frames(m)[static_cast<std::size_t>(body)].translation();
  if (site >= 0)
    at = body_frames(m)[static_cast<std::size_t>(body)] *
         Eigen::Map<const Eigen::Vector3d>(m.site_pos + 3 * static_cast<Eigen::Index>(site));
  Eigen::Map<Eigen::Vector3d>(plant.payload.com_m.data()) =
      link_frames(plant).back().inverse() * at;
  return {};
}

}  // namespace ravencal::physics
