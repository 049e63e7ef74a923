// SPDX-License-Identifier: Apache-2.0
//
// What the RAVEN-II controller computes from its joints: forward kinematics, the coupling of the
// tool joints, and its placeholder Jacobian. Constants: uw-biorobotics/raven2 src/raven
// r2_kinematics.cpp and include/raven/defines.h. Joint vectors have the controller's 8 slots.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "core/joint_layout.hpp"

namespace ravencal::physics {

enum class Arm { kGold, kGreen };

/// Joint positions or motor angles by slot: rad, insertion m.
using SlotVector = std::array<double, core::kSlotCount>;

/// Link twists and lengths of one arm after Craig's convention.
struct DhTable {
  std::array<double, 6> alpha_rad;
  std::array<double, 6> a_m;
  std::array<double, 6> d_m;  ///< without the insertion, which adds to d[2]
  std::array<double, 6> theta_offset_rad;
};
const DhTable& dh_table(Arm arm);

struct ToolPose {
  std::array<std::int32_t, 3>
      position_um{};                 ///< truncated to whole micrometres, as the controller does
  std::array<double, 9> rotation{};  ///< row-major
};

/// Pose of the tool in frame 0 (the remote centre, no base tilt).
ToolPose forward_kinematics(Arm arm, const SlotVector& joints_ji);

/// Motor angles [rad] of the tool joints that hold `joints_ji`, given the insertion motor's angle.
/// RAVEN tool: roll, wrist and jaws turn with the insertion motor through the capstans.
void tool_motors_from_joints(Arm arm, const SlotVector& joints_ji, SlotVector& motors_rad);

/// Joint positions [rad] of the tool from its motor angles; inverse of the above.
void tool_joints_from_motors(Arm arm, const SlotVector& motors_rad, SlotVector& joints_ji);

/// Motor rad per joint unit of a tool joint's slot.
double tool_reduction(core::JointSlot slot);

/// Six numbers that the controller publishes as `jac_vel`: a Jacobian with placeholder link lengths
/// (a3 = 6, twists of 1 rad, offsets 0; its source says "shouldn't be 2/1/1/6") times the joint
/// velocities. No physical meaning. The published code is not reproduced to the digit, only its
/// nature: a fixed function of jpos and jvel with those constants.
std::array<double, 6> placeholder_jacobian_velocity(const SlotVector& joints_ji,
                                                    const SlotVector& velocities_ji);

}  // namespace ravencal::physics
