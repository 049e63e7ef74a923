// SPDX-License-Identifier: Apache-2.0
//
// How the CRTK branch of the RAVEN-II controller takes joint commands: increments that arrive
// within a cycle add up, an absolute position replaces them, and no message moves a joint by more
// than 0.0025 rad or 5e-5 m (uw-biorobotics/raven2, update_device_state.cpp). Real-time safe.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace ravencal::robot {

enum class CommandKind : std::uint8_t {
  kRelative,  ///< servo_jr: rad, rad, m
  kAbsolute,  ///< servo_jp
  kVelocity,  ///< servo_jv: per second, for one cycle
};

class JointCommands {
 public:
  /// `joints` that are not finite are dropped.
  void take(CommandKind kind, const Eigen::Vector3d& joints) noexcept;
  /// The desired joints of this cycle from those of the last one; forgets what was taken.
  Eigen::Vector3d advance(const Eigen::Vector3d& desired_ji, double cycle_s) noexcept;
  void forget() noexcept;

  /// Largest move by one message.
  static const Eigen::Vector3d& largest_move_ji();

 private:
  Eigen::Vector3d increment_ji_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d absolute_ji_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_ji_per_s_ = Eigen::Vector3d::Zero();
  bool has_absolute_ = false;
};

}  // namespace ravencal::robot
