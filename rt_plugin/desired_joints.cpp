// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/desired_joints.hpp"

#include <algorithm>
#include <cmath>

namespace ravencal::rt {
namespace {

/// Without a branch: the instructions of a step do not depend on the data.
template <typename Number>
Number pick(bool first, Number yes, Number no) noexcept {
  const Number choice[2] = {no, yes};
  return choice[first ? 1 : 0];
}

}  // namespace

JointVector DesiredJoints::at_hook(const ravencal_arm& arm, const JointVector& before_ji,
                                   const JointVector& now_ji, Phase phase) noexcept {
  is_press_ = phase == Phase::kFollows && phase_ != Phase::kFollows;
  is_from_init_ = is_press_ && phase_ == Phase::kInit;
  phase_ = phase;
  if (phase != Phase::kFollows) press_is_doubted_ = false;
  JointVector moved_ji{};
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    Joint& joint = joints_[j];
    const float desired_ji = arm.jpos_d_ji[j];
    const double exact_ji = static_cast<double>(desired_ji);
    const bool changed = desired_ji != joint.left_ji;
    joint.motor_ji = pick(changed, exact_ji - static_cast<double>(before_ji[j]), joint.motor_ji);
    // Written since the last look: by a command, which would be the same without the plugin, or
    // from measured joints, behind the coupling of the cycle before. A host that left it where it
    // was shown, instead of moving it, wrote nothing.
    const double commanded_ji = joint.without_ji + (exact_ji - static_cast<double>(joint.left_ji));
    const bool is_measured = std::fabs(joint.motor_ji - static_cast<double>(joint.own_ji)) <=
                             kSeedCounts * kMotorCountJi[j];
    const bool written = changed & ((desired_ji != joint.shown_ji) | is_measured);
    const bool is_number = commanded_ji - commanded_ji == 0.0;
    const double seen_ji = pick(is_measured | !is_number, joint.motor_ji, commanded_ji);
    joint.without_ji = pick(written, seen_ji, joint.without_ji);
    // The sum of many small steps would drift by its rounding: each is taken from motor_ji.
    const bool moves = (phase != Phase::kFollows) & (now_ji[j] != before_ji[j]);
    const float taken_ji = static_cast<float>(joint.motor_ji + static_cast<double>(now_ji[j]));
    moved_ji[j] = pick(moves, taken_ji, desired_ji);
    joint.shown_ji = desired_ji;
    joint.left_ji = moved_ji[j];
    joint.own_ji = arm.jpos_ji[j];
    has_been_corrected_ = has_been_corrected_ | (now_ji[j] != 0.0F);
  }
  return moved_ji;
}

/// While the motors do not follow, the controller leaves a desired joint as it is or sets it to the
/// measured one, within the limits of its inverse kinematics. In INIT it sets what it likes, and
/// there is no correction.
void DesiredJoints::see_seed(Joint& joint, float desired_ji, float correction_ji) const noexcept {
  const std::size_t j = static_cast<std::size_t>(&joint - joints_.data());
  const double motor_ji = static_cast<double>(desired_ji) - static_cast<double>(correction_ji);
  const double own_ji = static_cast<double>(joint.own_ji);
  const bool is_measured = std::fabs(motor_ji - own_ji) <= kSeedCounts * kMotorCountJi[j];
  // A host that did not move a desired joint leaves it where it was shown. So does one that sets it
  // to a corrected joint that stands still at a limit, while the measured one goes on.
  if (desired_ji == joint.left_ji || (desired_ji == joint.shown_ji && !is_measured)) return;
  joint.left_ji = desired_ji;
  joint.motor_ji = motor_ji;
  const double seeded_ji =
      std::clamp(own_ji, static_cast<double>(lowest_ji_[j]), static_cast<double>(highest_ji_[j]));
  joint.without_ji = correction_ji == 0.0F || is_measured ? joint.motor_ji : seeded_ji;
}

/// In the first cycle of a press.
bool DesiredJoints::agrees(const Joint& joint, float desired_ji, float correction_ji,
                           double allowed_counts) const noexcept {
  const std::size_t j = static_cast<std::size_t>(&joint - joints_.data());
  const double with_ji = static_cast<double>(desired_ji) - static_cast<double>(correction_ji);
  // From a pose that was set in INIT, where nothing is corrected.
  const bool is_own = is_from_init_ && correction_ji == 0.0F && desired_ji != joint.left_ji;
  const double allowed_ji = allowed_counts * kMotorCountJi[j];
  const double measured_ji = kSeedCounts * kMotorCountJi[j];
  return is_own || !std::isfinite(with_ji) || std::fabs(with_ji - joint.without_ji) <= allowed_ji ||
         std::fabs(with_ji - static_cast<double>(joint.own_ji)) <= measured_ji;
}

bool DesiredJoints::at_coupling(const JointVector& desired_ji, const JointVector& correction_ji,
                                bool commanded, JointVector& agreed_ji) noexcept {
  bool disagrees = false;
  const double allowed_counts = commanded ? kCommandedPressCounts : kPressCounts;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    Joint& joint = joints_[j];
    agreed_ji[j] = correction_ji[j];
    if (phase_ != Phase::kFollows) {
      see_seed(joint, desired_ji[j], correction_ji[j]);
      continue;
    }
    const double with_ji =
        static_cast<double>(desired_ji[j]) - static_cast<double>(correction_ji[j]);
    if (is_press_ && has_been_corrected_ &&
        !agrees(joint, desired_ji[j], correction_ji[j], allowed_counts)) {
      agreed_ji[j] = static_cast<float>(static_cast<double>(desired_ji[j]) - joint.without_ji);
      disagrees = true;
    } else {
      joint.without_ji = with_ji;
    }
    // The motors go there: what the controller holds from then on, it would hold from there alone,
    // however far the correction moved with the commands.
    joint.left_ji = desired_ji[j];
    joint.motor_ji = joint.without_ji;
  }
  is_press_ = false;
  return disagrees;
}

}  // namespace ravencal::rt
