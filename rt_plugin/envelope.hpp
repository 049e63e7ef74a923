// SPDX-License-Identifier: Apache-2.0
//
// The safety envelope: decides each tick which state the plugin is in, and what that state lets the
// correction do. The correction moves by no more than the time allows that passed since the last
// tick, which counts as a tick at most. While the motors are free (pedal up, E-stop) that is slew *
// tick. While they follow (pedal down) it only goes along with the prediction (transfer.hpp), by at
// most a share of the motion that the operator commands, and stays where it is on any doubt. Used
// by the real-time thread only.
#pragma once

#include <cstdint>

#include "ravencal/plugin.h"
#include "rt_plugin/correction.hpp"
#include "rt_plugin/joint_range.hpp"
#include "rt_plugin/joint_vector.hpp"
#include "rt_plugin/transfer.hpp"

namespace ravencal::rt {

/// What the envelope is asked for in a cycle, beside the correction itself.
struct Asked {
  std::int32_t mode = RAVENCAL_MODE_OFF;  ///< RAVENCAL_MODE_*
  std::uint32_t doubts = 0;  ///< RAVENCAL_DOUBT_*; the prediction is used only without one
  bool reset = false;        ///< leaves FAULT
};

class Envelope {
 public:
  /// Correction is allowed after so long without a doubt, so that a flickering doubt does not make
  /// the correction flicker.
  static constexpr std::uint64_t kClearNs = 100'000'000;

  explicit Envelope(const ravencal_config& config) noexcept;

  /// One tick: the only place that changes the state. Returns RAVENCAL_OK, _HELD, _BYPASS or
  /// _FAULT.
  std::int32_t advance(const Asked& asked, const CorrectionRequest& request) noexcept;

  /// Keeps the part of the correction that is also in `correction_ji`: at a press that finds
  /// desired joints with less of it.
  void keep_part(const JointVector& correction_ji) noexcept;

  /// RAVENCAL_STATE_*
  [[nodiscard]] std::int32_t state() const noexcept {
    return is_shadow_ && state_ != RAVENCAL_STATE_FAULT ? RAVENCAL_STATE_SHADOW : state_;
  }
  /// In SHADOW, the state that it would be in; else state().
  [[nodiscard]] std::int32_t would_be_state() const noexcept { return state_; }
  /// In FAULT, or fading out on the way there.
  [[nodiscard]] bool faulted() const noexcept {
    return state_ == RAVENCAL_STATE_FAULT || faults_after_fade();
  }
  /// Whether a mode other than off begins with the next tick.
  [[nodiscard]] bool begins(std::int32_t mode) const noexcept {
    return mode != RAVENCAL_MODE_OFF &&
           (state_ == RAVENCAL_STATE_OFF || (is_shadow_ && mode != RAVENCAL_MODE_SHADOW));
  }
  /// What is applied: none in SHADOW.
  [[nodiscard]] const JointVector& correction_ji() const noexcept {
    return is_shadow_ ? kNone : correction_.ji();
  }
  /// In SHADOW, what would be applied; else what is.
  [[nodiscard]] const JointVector& would_be_ji() const noexcept { return correction_.ji(); }
  /// Correction minus the requested one, because the motors follow it; zero while they are free.
  [[nodiscard]] const JointVector& offset_ji() const noexcept { return transfer_.offset_ji(); }
  /// Joints whose correction could not follow the request in the last tick, in normal work.
  [[nodiscard]] std::uint32_t limited_joints() const noexcept { return limited_joints_; }
  /// In the last tick, part of a correction would have led beyond a limit of the controller.
  [[nodiscard]] bool is_at_limit() const noexcept { return is_at_limit_; }

 private:
  static constexpr JointVector kNone{};

  /// Where a correction goes in a cycle, and how fast.
  struct Way {
    JointVector target_ji{};
    JointVector step_ji{};
    bool fades = false;    ///< to what is asked for, as opposed to going on with it
    bool is_whole = true;  ///< without an offset
  };

  [[nodiscard]] std::int32_t next_state(std::int32_t before, bool enabled, std::uint32_t doubts,
                                        bool motors_follow) const noexcept;
  [[nodiscard]] bool may_hold(bool enabled, std::uint32_t doubts,
                              bool motors_follow) const noexcept;
  [[nodiscard]] bool faults_after_fade() const noexcept {
    return state_ == RAVENCAL_STATE_FADING_OUT && after_fade_ == RAVENCAL_STATE_FAULT;
  }
  [[nodiscard]] bool is_clear() const noexcept { return clear_ns_ > kClearNs; }
  Way way_in(std::int32_t state, const CorrectionRequest& request) noexcept;
  bool keep_in_range(const CorrectionRequest& request) noexcept;

  JointVector slew_per_tick_ji_{};  ///< largest change while the motors are free
  JointVector rate_per_tick_ji_{};  ///< largest change in normal work
  float follow_share_;
  JointRange range_;
  Transfer transfer_;
  std::uint32_t tick_ns_;
  std::uint64_t clear_ns_ = 0;  ///< without a doubt
  std::uint64_t hold_ticks_allowed_ = 0;
  /// In HOLD with free motors since the last kClearNs without a doubt.
  std::uint64_t hold_ticks_ = 0;
  std::int32_t state_ = RAVENCAL_STATE_OFF;       ///< never SHADOW: is_shadow_
  std::int32_t after_fade_ = RAVENCAL_STATE_OFF;  ///< where FADING_OUT leads
  bool is_shadow_ = false;                        ///< nothing of the correction is applied
  Correction correction_;
  std::uint32_t limited_joints_ = 0;
  bool is_at_limit_ = false;
};

}  // namespace ravencal::rt
