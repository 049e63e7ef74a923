// SPDX-License-Identifier: Apache-2.0
//
// The safety envelope: decides each tick which correction may be applied, and moves the applied one
// there, by no more than the time allows that passed since the last one, which counts as a tick at
// most. While the motors are free (pedal up, E-stop) it moves by at most slew * tick. While they
// follow (pedal down) it only goes along with the prediction (transfer.hpp), by at most a share of
// the motion that the operator commands, and stays where it is on any doubt. Used by the real-time
// thread only.
#pragma once

#include <cstdint>

#include "ravencal/plugin.h"
#include "rt_plugin/joint_range.hpp"
#include "rt_plugin/joint_vector.hpp"
#include "rt_plugin/transfer.hpp"

namespace ravencal::rt {

class Envelope {
 public:
  /// Correction is allowed after so long without a doubt, so that a flickering doubt does not make
  /// the correction flicker.
  static constexpr std::uint64_t kClearNs = 100'000'000;

  explicit Envelope(const ravencal_config& config) noexcept;

  /// One tick. `doubts`: RAVENCAL_DOUBT_* bits; the prediction is used only without doubts.
  /// Returns RAVENCAL_OK, _HELD, _BYPASS or _FAULT.
  std::int32_t advance(bool enabled, std::uint32_t doubts,
                       const CorrectionRequest& request) noexcept;

  /// The correction is this one from now on: at a press, which must move no motor.
  void take(const JointVector& correction_ji) noexcept;

  /// Leaves FAULT for OFF.
  void reset() noexcept;

  [[nodiscard]] std::int32_t state() const noexcept { return state_; }
  /// In FAULT, or fading out on the way there.
  [[nodiscard]] bool faulted() const noexcept {
    return state_ == RAVENCAL_STATE_FAULT ||
           (state_ == RAVENCAL_STATE_FADING_OUT && after_fade_ == RAVENCAL_STATE_FAULT);
  }
  [[nodiscard]] const JointVector& correction_ji() const noexcept { return correction_ji_; }
  /// Correction minus the requested one, because the motors follow it; zero while they are free.
  [[nodiscard]] const JointVector& offset_ji() const noexcept { return transfer_.offset_ji(); }
  /// Joints whose correction could not follow the request in the last tick, in normal work.
  [[nodiscard]] std::uint32_t limited_joints() const noexcept { return limited_joints_; }
  /// In the last tick, part of a correction would have led beyond a limit of the controller.
  [[nodiscard]] bool is_at_limit() const noexcept { return is_at_limit_; }

 private:
  [[nodiscard]] std::int32_t next_state(bool enabled, std::uint32_t doubts,
                                        bool motors_follow) const noexcept;
  [[nodiscard]] bool may_hold(bool enabled, std::uint32_t doubts,
                              bool motors_follow) const noexcept;
  [[nodiscard]] bool is_clear() const noexcept { return clear_ns_ > kClearNs; }
  /// From one resting state to the next: that one, or a fade first where a correction is left.
  [[nodiscard]] std::int32_t way_to(std::int32_t resting) const noexcept;
  std::int32_t move(bool enabled, std::uint32_t doubts, const CorrectionRequest& request) noexcept;
  void keep_in_range(const CorrectionRequest& request) noexcept;
  void measure_steps(std::uint32_t passed_ns) noexcept;
  void correct(const CorrectionRequest& request) noexcept;
  std::int32_t fade_out(const CorrectionRequest& request) noexcept;
  std::uint32_t move_towards(const JointVector& target_ji, const JointVector& step_ji) noexcept;

  JointVector slew_per_tick_ji_{};  ///< largest change while the motors are free
  JointVector rate_per_tick_ji_{};  ///< largest change in normal work
  JointVector slew_step_ji_{};      ///< the same, of the tick at hand
  JointVector rate_step_ji_{};
  JointVector max_correction_ji_{};
  float follow_share_;
  JointRange range_;
  Transfer transfer_;
  std::uint32_t tick_ns_;
  float passed_ticks_ = 0.0F;   ///< 0..1, of the tick at hand
  std::uint64_t clear_ns_ = 0;  ///< without a doubt
  std::uint64_t hold_ticks_allowed_ = 0;
  /// In HOLD with free motors since the last kClearNs without a doubt.
  std::uint64_t hold_ticks_ = 0;
  std::int32_t state_ = RAVENCAL_STATE_OFF;
  std::int32_t after_fade_ = RAVENCAL_STATE_OFF;  ///< where FADING_OUT leads
  JointVector correction_ji_{};
  std::uint32_t limited_joints_ = 0;
  bool is_at_limit_ = false;
};

}  // namespace ravencal::rt
