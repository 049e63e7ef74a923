// SPDX-License-Identifier: Apache-2.0
//
// The controller's desired joints, which hold the correction. While the motors do not follow, they
// move with it, so that a press of the pedal finds the motor position that it would find without
// the plugin. While they do, what the motors are sent to stays within their own limits. ABI.md has
// the argument. Real-time thread only.
#pragma once

#include <array>
#include <cstddef>

#include "ravencal/plugin.h"
#include "rt_plugin/joint_vector.hpp"

namespace ravencal::rt {

/// One count of the encoder of a joint's motor: 2 pi / 4000 rad, divided by RAVEN-II's reductions
/// (136.196, 121.522, 2158.59 rad/m; defines.h of the controller).
inline constexpr std::array<double, RAVENCAL_JOINTS> kMotorCountJi = {1.1533e-5, 1.2926e-5,
                                                                      7.2771e-7};

class DesiredJoints {
 public:
  /// Inverse kinematics of the measured pose, which the controller holds in whole micrometres, give
  /// the measured joints to within so many counts: 1.7 micrometres at 1 cm from the remote centre.
  static constexpr double kSeedCounts = 16.0;

  /// Which cycle it is, for the desired joints.
  enum class Phase {
    kInit,     ///< no correction: the controller writes what it would write alone
    kFree,     ///< the motors do not follow
    kFollows,  ///< the motors follow
  };

  explicit DesiredJoints(const ravencal_config& config) noexcept
      : lowest_ji_(std::to_array(config.lowest_ji)),
        highest_ji_(std::to_array(config.highest_ji)) {}

  /// Start of a cycle. `arm`: measured joints without a correction, desired ones with that of the
  /// cycle before, `before_ji`; it is `now_ji` in this one. Returns where the desired joints have
  /// to be.
  JointVector at_hook(const ravencal_arm& arm, const JointVector& before_ji,
                      const JointVector& now_ji, Phase phase) noexcept;

  /// Before the inverse cable coupling: the correction that is in the desired joints, as far as it
  /// is a part of `correction_ji`. Another one than that only in the first cycle of a press, which
  /// is then doubted. A command of any size says nothing about it.
  JointVector correction_in(const JointVector& desired_ji,
                            const JointVector& correction_ji) noexcept;

  /// The same cycle, after it: motor_side_ji(...), where the motors go if they follow.
  JointVector send(const JointVector& desired_ji, const JointVector& correction_ji) noexcept;

  /// `desired_ji` without the correction. While the motors follow and there is one, within the
  /// limits of the joints, or as far beyond as they were sent last.
  [[nodiscard]] JointVector motor_side_ji(const JointVector& desired_ji,
                                          const JointVector& correction_ji) const noexcept;

  /// The desired joints of the press in force held another correction than the one applied.
  [[nodiscard]] bool press_is_doubted() const noexcept { return press_is_doubted_; }
  /// The last command ended at a limit of the motor side.
  [[nodiscard]] bool is_at_limit() const noexcept { return is_at_limit_; }

 private:
  struct Joint {
    float shown_ji = 0.0F;             ///< desired joint at the last hook
    float left_ji = 0.0F;              ///< the same when it was looked at last, moved
    float shown_correction_ji = 0.0F;  ///< the one in shown_ji
    float left_correction_ji = 0.0F;   ///< the one in left_ji
    double motor_ji = 0.0;             ///< left_ji without it: where the motor is sent to
    float own_ji = 0.0F;               ///< measured, of the cycle at hand
  };
  [[nodiscard]] double motor_side_ji(std::size_t joint, float desired_ji,
                                     float correction_ji) const noexcept;
  void see_seed(Joint& joint, float desired_ji, float correction_ji) const noexcept;

  JointVector lowest_ji_;  ///< where the controller's inverse kinematics saturate
  JointVector highest_ji_;
  std::array<Joint, RAVENCAL_JOINTS> joints_{};
  Phase phase_ = Phase::kFree;
  bool is_press_ = false;  ///< the first cycle in which the motors follow
  bool press_is_doubted_ = false;
  bool is_at_limit_ = false;
};

}  // namespace ravencal::rt
