// SPDX-License-Identifier: Apache-2.0
//
// Where the first three joints of a RAVEN-II arm lie: twists and joint offsets after Craig's
// convention, with link lengths 0. Source: uw-biorobotics/raven2, src/raven/r2_kinematics.cpp and
// include/raven/r2_kinematics_defs.h (La12 = 75 deg, La23 = 52 deg).
#pragma once

#include <array>
#include <numbers>

namespace ravencal::core {

struct ArmGeometry {
  std::array<double, 3> twist_rad;         ///< alpha of joints 1 to 3
  std::array<double, 3> joint_offset_rad;  ///< theta at joint position 0; of the insertion: theta
};

inline constexpr double kRadPerDegree = std::numbers::pi / 180.0;
inline constexpr ArmGeometry kGoldGeometry = {
    {0.0, 75.0 * kRadPerDegree, 128.0 * kRadPerDegree},
    {205.0 * kRadPerDegree, 180.0 * kRadPerDegree, 90.0 * kRadPerDegree}};
inline constexpr ArmGeometry kGreenGeometry = {
    {180.0 * kRadPerDegree, 75.0 * kRadPerDegree, 52.0 * kRadPerDegree},
    {25.0 * kRadPerDegree, 0.0, -90.0 * kRadPerDegree}};

}  // namespace ravencal::core
