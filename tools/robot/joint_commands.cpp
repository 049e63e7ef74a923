// SPDX-License-Identifier: Apache-2.0
#include "robot/joint_commands.hpp"

namespace ravencal::robot {
namespace {

using Eigen::Vector3d;

Vector3d clamped(const Vector3d& move) {
  const Vector3d& largest = JointCommands::largest_move_ji();
  return move.cwiseMin(largest).cwiseMax(-largest);
}

}  // namespace

const Vector3d& JointCommands::largest_move_ji() {
  static const Vector3d largest(0.0025, 0.0025, 5e-5);
  return largest;
}

void JointCommands::take(CommandKind kind, const Vector3d& joints) noexcept {
  if (!joints.allFinite()) return;
  switch (kind) {
    case CommandKind::kRelative:
      increment_ji_ += clamped(joints);
      return;
    case CommandKind::kAbsolute:
      absolute_ji_ = joints;
      has_absolute_ = true;
      return;
    case CommandKind::kVelocity:
      velocity_ji_per_s_ = joints;
      return;
  }
}

Vector3d JointCommands::advance(const Vector3d& desired_ji, double cycle_s) noexcept {
  Vector3d next = desired_ji + increment_ji_ + clamped(velocity_ji_per_s_ * cycle_s);
  if (has_absolute_) next = desired_ji + clamped(absolute_ji_ - desired_ji);
  forget();
  return next;
}

void JointCommands::forget() noexcept { *this = JointCommands(); }

}  // namespace ravencal::robot
