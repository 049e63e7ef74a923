// SPDX-License-Identifier: Apache-2.0
//
// How the CRTK branch of the RAVEN-II controller takes joint commands (uw-biorobotics/raven2,
// branch crtk): increments that arrive within a cycle add up, of the other kinds the last one
// counts, and of several kinds one: increments before positions before velocities
// (crtk_motion_api.cpp, check_setpoint_updates). A cycle moves a joint by 0.0025 rad or 5e-5 m at
// most, however many messages came (update_device_state.cpp, update_device_crtk_motion_js).
// Real-time safe.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace ravencal::robot {

/// Arms as CRTK numbers them. Commands for arm1 go to the controller's mech[0], whichever arm that
/// is, those for arm2 to mech[1] (local_io.cpp, update_device_motion_api).
enum class CrtkArm : std::uint8_t { kArm1, kArm2 };

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
  /// Whether something was taken since the last cycle.
  [[nodiscard]] bool pending() const { return has_increment_ || has_absolute_ || has_velocity_; }

  /// Largest move in one cycle.
  static const Eigen::Vector3d& largest_move_ji();

 private:
  Eigen::Vector3d increment_ji_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d absolute_ji_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_ji_per_s_ = Eigen::Vector3d::Zero();
  bool has_increment_ = false;
  bool has_absolute_ = false;
  bool has_velocity_ = false;
};

}  // namespace ravencal::robot
