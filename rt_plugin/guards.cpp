// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/guards.hpp"

#include <algorithm>
#include <cmath>

namespace ravencal::rt {
StateGuards::StateGuards(const ravencal_config& config) noexcept
    : tick_ns_(config.tick_ns),
      max_encoder_step_(config.max_encoder_step_counts == 0 ? UINT64_MAX / kLongestGapTicks
                                                            : config.max_encoder_step_counts) {}

std::uint32_t StateGuards::inspect(const ravencal_state& state) noexcept {
  ++cycles_;
  // The clock first: the others count in the ticks that have passed.
  const std::uint32_t clock = inspect_clock(state.t_ns);
  return clock | inspect_robot(state) | inspect_pedal(state) | inspect_encoders(state.arm[0]);
}

std::uint32_t StateGuards::inspect_magnitude(const JointVector& predicted_ji,
                                             const JointVector& largest_ji) noexcept {
  bool too_large = false;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    too_large = too_large || std::fabs(predicted_ji[j]) > largest_ji[j];
  }
  return too_large ? RAVENCAL_DOUBT_MAGNITUDE : 0U;
}

/// Both pedal positions. Not in E-stop (0) and INIT (1): there the cables hang without torque, or
/// the robot homes, which computes its zeros from uncorrected joints.
std::uint32_t StateGuards::inspect_robot(const ravencal_state& state) const noexcept {
  return is_running(state.runlevel) && is_homed(state.arm[0]) ? 0U : RAVENCAL_DOUBT_ROBOT_STATE;
}

/// When the pedal moves, the controller sets its desired joints to the measured ones. It debounces
/// the pedal over three cycles, so the copy may be used some cycles after it was taken.
std::uint32_t StateGuards::inspect_pedal(const ravencal_state& state) noexcept {
  const bool moved = cycles_ > 1 && state.runlevel != runlevel_ && is_running(state.runlevel) &&
                     is_running(runlevel_);
  has_stopped_ = cycles_ > 1 && is_running(runlevel_) && !is_running(state.runlevel);
  runlevel_ = state.runlevel;
  pedal_left_ns_ = moved ? kPedalNs : pedal_left_ns_ - std::min(pedal_left_ns_, passed_ns_);
  return pedal_left_ns_ > 0 ? RAVENCAL_DOUBT_PEDAL : 0U;
}

/// Time must advance from step to step, and not by much more than a tick.
std::uint32_t StateGuards::inspect_clock(std::int64_t t_ns) noexcept {
  // Unsigned subtraction is defined for every pair of times; a step back becomes a huge gap.
  const std::uint64_t gap_ns =
      static_cast<std::uint64_t>(t_ns) - static_cast<std::uint64_t>(last_ns_);
  const bool first = cycles_ == 1;
  previous_ns_ = last_ns_;
  last_ns_ = t_ns;
  const bool advanced = gap_ns > 0 && gap_ns <= static_cast<std::uint64_t>(INT64_MAX);
  passed_ns_ = advanced ? static_cast<std::uint32_t>(std::min<std::uint64_t>(gap_ns, tick_ns_)) : 0;
  const bool jumped = gap_ns == 0 || gap_ns > kLongestGapTicks * tick_ns_;
  const std::uint64_t ticks = jumped ? kLongestGapTicks : (gap_ns + tick_ns_ / 2) / tick_ns_;
  elapsed_ticks_ = ticks > 0 ? ticks : 1;
  return jumped && !first ? RAVENCAL_DOUBT_TIME : 0U;
}

/// Motors have a top speed; a count that changes faster was misread or set anew.
std::uint32_t StateGuards::inspect_encoders(const ravencal_arm& arm) noexcept {
  bool jumped = false;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    const std::int64_t step = std::int64_t{arm.enc_counts[j]} - counts_[j];
    const auto size = static_cast<std::uint64_t>(step < 0 ? -step : step);
    jumped = jumped || size > max_encoder_step_ * elapsed_ticks_;
    counts_[j] = arm.enc_counts[j];
  }
  return jumped && cycles_ > 1 ? RAVENCAL_DOUBT_ENCODER_JUMP : 0U;
}

}  // namespace ravencal::rt
