// SPDX-License-Identifier: Apache-2.0
//
// The controller's desired joints, which hold the correction. While the motors do not follow, they
// move with it, so that a press of the pedal finds the motor position that it would find without
// the plugin. At a press, the motor step is compared with the one that the controller would make
// alone. ABI.md has the proof. Real-time thread only.
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
  /// A press may add so many counts to a motor's command.
  static constexpr double kPressCounts = 2.0;
  /// The same where the operator moves the desired pose in that very cycle, which cannot be told
  /// from a pose in other coordinates: as far as a motor turns in a cycle (exports.cpp, RE40).
  static constexpr double kCommandedPressCounts = 512.0;
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

  /// Before the inverse cable coupling. `commanded`: the desired pose moved since the cycle before.
  /// In the first cycle of a press, returns whether the press would move a motor because of the
  /// correction; `agreed_ji` is then the correction with which it does not.
  bool at_coupling(const JointVector& desired_ji, const JointVector& correction_ji, bool commanded,
                   JointVector& agreed_ji) noexcept;

  /// The press in force was found to disagree.
  void doubt_press() noexcept { press_is_doubted_ = true; }
  [[nodiscard]] bool press_is_doubted() const noexcept { return press_is_doubted_; }

 private:
  struct Joint {
    float shown_ji = 0.0F;    ///< desired joint at the last hook
    float left_ji = 0.0F;     ///< the same when it was looked at last, moved
    double motor_ji = 0.0;    ///< that one without the correction: what the motor is sent to
    double without_ji = 0.0;  ///< what the motor would be sent to without the plugin, from where it
                              ///< last followed
    float own_ji = 0.0F;      ///< measured, of the cycle at hand
  };
  void see_seed(Joint& joint, float desired_ji, float correction_ji) const noexcept;
  [[nodiscard]] bool agrees(const Joint& joint, float desired_ji, float correction_ji,
                            double allowed_counts) const noexcept;

  JointVector lowest_ji_;  ///< where the controller's inverse kinematics saturate
  JointVector highest_ji_;
  std::array<Joint, RAVENCAL_JOINTS> joints_{};
  Phase phase_ = Phase::kFree;
  bool is_press_ = false;      ///< the first cycle in which the motors follow
  bool is_from_init_ = false;  ///< and the one before was of INIT
  bool has_been_corrected_ = false;
  bool press_is_doubted_ = false;
};

}  // namespace ravencal::rt
