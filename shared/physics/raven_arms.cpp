// SPDX-License-Identifier: Apache-2.0
#include "physics/raven_arms.hpp"

#include <array>

namespace ravencal::physics {
namespace {

// The mirror image of frame i of the gold arm is frame i of the green arm with these axes turned
// round: what mirroring y in frame 0 makes of the two tables of r2_kinematics.cpp.
constexpr std::array<std::array<double, 3>, 3> kMirrored = {{
    {-1.0, -1.0, -1.0},
    {1.0, 1.0, -1.0},
    {1.0, -1.0, 1.0},
}};

void mirror(const std::array<double, 3>& signs, std::array<double, 3>& point_m) {
  for (std::size_t axis = 0; axis < 3; ++axis) point_m[axis] *= signs[axis];
}

}  // namespace

Plant plant_of_arm(Plant plant, std::string_view arm) {
  if (plant.robot.arm == arm) return plant;
  plant.robot.arm = arm;
  for (std::size_t i = 0; i < plant.joints.size(); ++i) {
    Joint& joint = plant.joints[i];
    joint.encoder_sign = -joint.encoder_sign;
    joint.drive.dac_counts_per_n_m = -joint.drive.dac_counts_per_n_m;
    if (i < kMirrored.size()) mirror(kMirrored[i], joint.link.com_m);
  }
  mirror(kMirrored.back(), plant.payload.com_m);
  return plant;
}

}  // namespace ravencal::physics
