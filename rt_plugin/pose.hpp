// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "core/raven_arm.hpp"

namespace ravencal::rt {

/// [rt] Moves a pose from where joints 1 to 3 are at `from_ji` to where they are at `to_ji` (rad,
/// rad, m), the tool being rigid: pose := F(to) F(from)^-1 pose, with F the frame of joint 3.
/// `position_um` is rounded to whole micrometres; `rotation` is row-major.
void move_pose(const core::ArmGeometry& arm, const float from_ji[3], const float to_ji[3],
               std::int32_t position_um[3], float rotation[9]) noexcept;

}  // namespace ravencal::rt
