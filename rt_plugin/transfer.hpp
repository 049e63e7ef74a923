// SPDX-License-Identifier: Apache-2.0
//
// Bumpless transfer (K. J. Astrom and T. Hagglund, Advanced PID Control, 2006): while the motors
// follow the correction, a change that would make it step (new weights, another confidence, a
// correction that begins or resumes) becomes an offset instead. The correction is the requested one
// plus the offset, so it moves only with the prediction. The offset shrinks with the motion that
// the operator commands, and is dropped when the motors are free. Real-time thread only.
#pragma once

#include <cstddef>
#include <cstdint>

#include "rt_plugin/joint_vector.hpp"

namespace ravencal::rt {

/// What the weights say in one cycle, and how it may reach the motors.
struct CorrectionRequest {
  JointVector predicted_ji{};   ///< error of the joints that the network predicts
  JointVector constant_ji{};    ///< the part of it that does not change: the training set's mean
  float confidence = 0.0F;      ///< 0..1: share of what differs from the constant part
  bool same_weights = true;     ///< the prediction goes on from that of the cycle before
  bool motors_follow = false;   ///< the pedal is down: a change of the correction moves the motors
  bool is_init = false;         ///< the robot may home: nothing may be corrected
  JointVector own_ji{};         ///< measured joints without a correction
  JointVector commanded_ji{};   ///< how far each desired joint moved since the cycle before, >= 0
  JointVector travelled_ji{};   ///< the same, without what goes to and fro (CommandedMotion)
  JointVector largest_ji{};     ///< the correction never exceeds this
  std::uint32_t passed_ns = 0;  ///< time since the cycle before, but at most a tick

  [[nodiscard]] float requested_ji(std::size_t joint) const noexcept {
    return constant_ji[joint] + confidence * (predicted_ji[joint] - constant_ji[joint]);
  }
};

class Transfer {
 public:
  Transfer(float blend_share, const JointVector& blend_step_ji) noexcept
      : blend_share_(blend_share), blend_step_ji_(blend_step_ji) {}

  /// Motors follow, no doubt: where the correction, now `applied_ji`, may go in this cycle, in
  /// which `passed_ticks` (0..1) of a tick passed. The first cycle after forget() stays at
  /// `applied_ji`.
  JointVector follow(const CorrectionRequest& request, const JointVector& applied_ji,
                     float passed_ticks) noexcept;

  /// What was said before has no bearing on the next cycle.
  void forget() noexcept {
    joined_ = false;
    offset_ji_ = JointVector{};
  }

  [[nodiscard]] const JointVector& offset_ji() const noexcept { return offset_ji_; }

 private:
  float blend_share_;
  JointVector blend_step_ji_;
  bool joined_ = false;  ///< the fields below are of the cycle before
  float confidence_ = 0.0F;
  JointVector variable_ji_{};  ///< prediction without its constant part
  JointVector offset_ji_{};
};

}  // namespace ravencal::rt
