// SPDX-License-Identifier: Apache-2.0
//
// Play and stretch between a drive and its joint, as robot models state them: a further joint about
// the same axis on the same body, which nothing drives. The drive's joint is the one before it, and
// the link is where both together are.
#pragma once

#include <mujoco/mujoco.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ravencal::physics {

enum class SeriesKind { kBacklash, kCable };

struct SeriesJoint {
  SeriesKind kind = SeriesKind::kBacklash;
  int of = 0;  ///< the drive's joint
};

/// `JOINT_backlash` (a range about zero, as onshape-to-robot writes it) or `JOINT_cable` (a spring
/// about zero). Empty for any other joint.
std::optional<SeriesJoint> series_joint(const mjModel& model, int joint);
std::string series_name(std::string_view joint, SeriesKind kind);

/// The joints that a plant has, in its order: all others.
std::vector<int> plant_joints(const mjModel& model);

/// The model's name, or `joint` and its number.
std::string joint_name(const mjModel& model, int joint);

}  // namespace ravencal::physics
