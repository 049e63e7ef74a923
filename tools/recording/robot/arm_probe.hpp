// SPDX-License-Identifier: Apache-2.0
//
// Finds out which of the CRTK arms, /arm1 or /arm2, drives the arm that is to be calibrated: on the
// CRTK branch the order of the USB boards decides. Moves an elbow by a fraction of a degree and
// back, through one topic after the other, and looks whose desired joints the controller changes:
// those answer at once, whatever friction does. Driven by the robot's states as the follower is.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>

#include "robot/joint_commands.hpp"
#include "robot/motion_limits.hpp"

namespace ravencal::robot {

struct RobotView;

class ArmProbe {
 public:
  /// How far the elbow is moved, rad.
  static constexpr double kReachRad = 0.0052;  // 0.3 deg

  explicit ArmProbe(const MotionLimits& limits) : limits_(limits) {}

  /// Forgets what an interrupted probe has seen.
  void restart();
  /// The increment to send through arm() after this state, if any.
  std::optional<Eigen::Vector3d> step(const RobotView& view, double dt_s);

  /// The CRTK arm that is being tried, and once found, the one that drives the calibrated arm.
  [[nodiscard]] CrtkArm arm() const { return arm_; }
  [[nodiscard]] bool found() const { return found_; }
  /// Why none was found; empty while it tries or has found one.
  [[nodiscard]] const std::string& failure() const { return failure_; }

 private:
  enum class Leg : std::uint8_t { kSilence, kOut, kWait, kBack, kRest };
  void start(const RobotView& view);
  void watch(const RobotView& view);
  void go_on(Leg leg);
  void judge();
  Eigen::Vector3d move(double share_of_reach);

  MotionLimits limits_;
  CrtkArm arm_ = CrtkArm::kArm1;
  Leg leg_ = Leg::kSilence;
  bool found_ = false;
  int round_ = 0;
  std::string failure_;
  double direction_ = 1.0;
  double leg_s_ = 0.0;
  double sent_ = 0.0;  ///< share of the reach
  double own_last_rad_ = 0.0;
  double other_last_rad_ = 0.0;
  double own_moved_rad_ = 0.0;
  double other_moved_rad_ = 0.0;
};

}  // namespace ravencal::robot
