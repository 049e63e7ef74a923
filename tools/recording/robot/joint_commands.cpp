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
      increment_ji_ += joints;
      has_increment_ = true;
      return;
    case CommandKind::kAbsolute:
      absolute_ji_ = joints;
      has_absolute_ = true;
      return;
    case CommandKind::kVelocity:
      velocity_ji_per_s_ = joints;
      has_velocity_ = true;
      return;
  }
}

Vector3d JointCommands::advance(const Vector3d& desired_ji, double cycle_s) noexcept {
  Vector3d move = Vector3d::Zero();
  if (has_increment_) {
    move = increment_ji_;
  } else if (has_absolute_) {
    move = absolute_ji_ - desired_ji;
  } else if (has_velocity_) {
    move = velocity_ji_per_s_ * cycle_s;
  }
  forget();
  return desired_ji + clamped(move);
}

void JointCommands::forget() noexcept { *this = JointCommands(); }

}  // namespace ravencal::robot
