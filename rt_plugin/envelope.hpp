// SPDX-License-Identifier: Apache-2.0
//
// The safety envelope: decides each tick whether a correction may be applied, and moves the applied
// correction towards what is wanted, never faster than a fixed rate. Whatever the inputs are, one
// tick changes the correction of a joint by at most slew * tick, in ACTIVE max_correction_rate *
// tick. Used by the real-time thread only.
#pragma once

#include <array>
#include <cstdint>

#include "ravencal/plugin.h"

namespace ravencal::rt {

using JointVector = std::array<float, RAVENCAL_JOINTS>;  ///< rad, rad, m

class Envelope {
 public:
  /// Correction is allowed after so long without a doubt, so that a flickering doubt does not make
  /// the correction flicker.
  static constexpr std::uint64_t kClearNs = 100'000'000;

  explicit Envelope(const ravencal_config& config) noexcept;

  /// One tick. `doubts`: RAVENCAL_DOUBT_* bits; `wanted_ji` is used only without doubts.
  /// Returns RAVENCAL_OK, _HELD, _BYPASS or _FAULT.
  std::int32_t advance(bool enabled, std::uint32_t doubts, const JointVector& wanted_ji) noexcept;

  /// The prediction may jump at the next tick (new weights): reach it by the slew, not the rate.
  void refade() noexcept;

  /// Leaves FAULT for OFF.
  void reset() noexcept;

  [[nodiscard]] std::int32_t state() const noexcept { return state_; }
  /// In FAULT, or fading out on the way there.
  [[nodiscard]] bool faulted() const noexcept {
    return state_ == RAVENCAL_STATE_FAULT ||
           (state_ == RAVENCAL_STATE_FADING_OUT && after_fade_ == RAVENCAL_STATE_FAULT);
  }
  [[nodiscard]] const JointVector& correction_ji() const noexcept { return correction_ji_; }
  /// Joints whose correction could not follow what is wanted in the last tick, in normal work.
  [[nodiscard]] std::uint32_t limited_joints() const noexcept { return limited_joints_; }

 private:
  [[nodiscard]] std::int32_t next_state(bool enabled, std::uint32_t doubts) const noexcept;
  [[nodiscard]] bool may_hold(bool enabled, std::uint32_t doubts) const noexcept;
  [[nodiscard]] bool is_faded_out() const noexcept;
  std::uint32_t move_towards(const JointVector& target_ji, const JointVector& step_ji) noexcept;

  JointVector slew_step_ji_{};  ///< largest change per tick while fading
  JointVector rate_step_ji_{};  ///< largest change per tick in normal work
  std::uint64_t clear_ticks_needed_ = 0;
  std::uint64_t clear_ticks_ = 0;
  std::uint64_t hold_ticks_allowed_ = 0;
  std::uint64_t hold_ticks_ = 0;  ///< in HOLD since the last kClearNs without a doubt
  std::int32_t state_ = RAVENCAL_STATE_OFF;
  std::int32_t after_fade_ = RAVENCAL_STATE_OFF;  ///< where FADING_OUT leads
  JointVector correction_ji_{};
  std::uint32_t limited_joints_ = 0;
};

}  // namespace ravencal::rt
