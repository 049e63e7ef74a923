// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/desired_joints.hpp"

#include <algorithm>
#include <cmath>

#include "rt_plugin/correction.hpp"

namespace ravencal::rt {
namespace {

/// Without a branch: the instructions of a step do not depend on the data.
template <typename Number>
Number pick(bool first, Number yes, Number no) noexcept {
  const Number choice[2] = {no, yes};
  return choice[first ? 1 : 0];
}

bool is_near(double a_ji, double b_ji, std::size_t joint) noexcept {
  return std::fabs(a_ji - b_ji) <= DesiredJoints::kSeedCounts * kMotorCountJi[joint];
}

}  // namespace

JointVector DesiredJoints::at_hook(const ravencal_arm& arm, const JointVector& before_ji,
                                   const JointVector& now_ji, Phase phase) noexcept {
  is_press_ = phase == Phase::kFollows && phase_ != Phase::kFollows;
  phase_ = phase;
  if (phase != Phase::kFollows) press_is_doubted_ = is_at_limit_ = false;
  JointVector moved_ji{};
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    Joint& joint = joints_[j];
    const float desired_ji = arm.jpos_d_ji[j];
    const double exact_ji = static_cast<double>(desired_ji);
    const double written_ji = exact_ji - static_cast<double>(before_ji[j]);
    const bool changed = desired_ji != joint.left_ji;
    // A host that left it where it was shown, instead of moving it, wrote nothing.
    const bool written = changed & ((desired_ji != joint.shown_ji) |
                                    is_near(written_ji, static_cast<double>(joint.own_ji), j));
    const float old_ji = pick(changed, joint.shown_correction_ji, joint.left_correction_ji);
    joint.shown_correction_ji = pick(written, before_ji[j], old_ji);
    // While the motors follow, they are where send() had them.
    joint.motor_ji = pick(written & (phase != Phase::kFollows), written_ji, joint.motor_ji);
    // The sum of many small steps would drift by its rounding: each is taken from motor_ji.
    const bool moves = (phase != Phase::kFollows) & (now_ji[j] != before_ji[j]);
    const float taken_ji = static_cast<float>(joint.motor_ji + static_cast<double>(now_ji[j]));
    moved_ji[j] = pick(moves, taken_ji, desired_ji);
    joint.shown_ji = desired_ji;
    joint.left_ji = moved_ji[j];
    joint.left_correction_ji = pick(moves, now_ji[j], joint.shown_correction_ji);
    joint.own_ji = arm.jpos_ji[j];
  }
  return moved_ji;
}

/// While the motors do not follow, the controller leaves a desired joint as it is or sets it to the
/// measured one, within the limits of its inverse kinematics: then it holds what lies between it
/// and the measured one. In INIT it sets what it likes, and there is no correction.
void DesiredJoints::see_seed(Joint& joint, float desired_ji, float correction_ji) const noexcept {
  const std::size_t j = static_cast<std::size_t>(&joint - joints_.data());
  const double motor_ji = static_cast<double>(desired_ji) - static_cast<double>(correction_ji);
  const bool is_measured = is_near(motor_ji, static_cast<double>(joint.own_ji), j);
  if (desired_ji == joint.left_ji) return;
  if (desired_ji == joint.shown_ji && !is_measured) {
    joint.left_correction_ji = joint.shown_correction_ji;
  } else {
    const bool is_whole = is_measured || phase_ == Phase::kInit;
    joint.left_correction_ji = is_whole ? correction_ji : desired_ji - joint.own_ji;
    joint.motor_ji =
        static_cast<double>(desired_ji) - static_cast<double>(joint.left_correction_ji);
  }
  joint.left_ji = desired_ji;
}

JointVector DesiredJoints::correction_in(const JointVector& desired_ji,
                                         const JointVector& correction_ji) noexcept {
  JointVector part_ji = correction_ji;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    Joint& joint = joints_[j];
    if (phase_ != Phase::kFollows) see_seed(joint, desired_ji[j], correction_ji[j]);
    if (!is_press_) continue;
    // A command of this cycle went out from the desired joint or pose of the cycle before.
    const float held_ji = joint.left_correction_ji;
    const float kept_ji = Correction::part_of(correction_ji[j], held_ji);
    const bool agrees =
        is_near(static_cast<double>(held_ji), static_cast<double>(correction_ji[j]), j) ||
        correction_ji[j] == 0.0F || !std::isfinite(held_ji);
    part_ji[j] = agrees ? correction_ji[j] : kept_ji;
    press_is_doubted_ = press_is_doubted_ || !agrees;
  }
  is_press_ = false;
  return part_ji;
}

double DesiredJoints::motor_side_ji(std::size_t j, float desired_ji,
                                    float correction_ji) const noexcept {
  const double motor_ji = static_cast<double>(desired_ji) - static_cast<double>(correction_ji);
  if (phase_ != Phase::kFollows || correction_ji == 0.0F) return motor_ji;
  const double low_ji = std::min(static_cast<double>(lowest_ji_[j]), joints_[j].motor_ji);
  const double high_ji = std::max(static_cast<double>(highest_ji_[j]), joints_[j].motor_ji);
  return motor_ji < low_ji ? low_ji : motor_ji > high_ji ? high_ji : motor_ji;
}

JointVector DesiredJoints::motor_side_ji(const JointVector& desired_ji,
                                         const JointVector& correction_ji) const noexcept {
  JointVector motor_ji{};
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    motor_ji[j] = static_cast<float>(motor_side_ji(j, desired_ji[j], correction_ji[j]));
    // Denormal numbers count as zero in a difference, not in a copy.
    if (correction_ji[j] == 0.0F) motor_ji[j] = desired_ji[j];
  }
  return motor_ji;
}

JointVector DesiredJoints::send(const JointVector& desired_ji,
                                const JointVector& correction_ji) noexcept {
  const JointVector sent_ji = motor_side_ji(desired_ji, correction_ji);
  if (phase_ != Phase::kFollows) return sent_ji;
  is_at_limit_ = false;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    Joint& joint = joints_[j];
    const double motor_ji = motor_side_ji(j, desired_ji[j], correction_ji[j]);
    const double asked_ji =
        static_cast<double>(desired_ji[j]) - static_cast<double>(correction_ji[j]);
    is_at_limit_ = is_at_limit_ || motor_ji < asked_ji || motor_ji > asked_ji;
    // What the controller holds from then on, it would hold from there alone, however far the
    // correction moved with the commands.
    joint.motor_ji = motor_ji;
    joint.left_ji = desired_ji[j];
    joint.left_correction_ji = correction_ji[j];
  }
  return sent_ji;
}

}  // namespace ravencal::rt
