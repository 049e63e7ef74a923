// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/envelope.hpp"

namespace ravencal::rt {
namespace {

constexpr double kSecondsPerNs = 1e-9;

/// Doubts about a cycle or a few, during which the correction may stay where it is. The others are
/// about the robot, the weights or the plugin itself, and end it at once.
constexpr std::uint32_t kMayPass =
    RAVENCAL_DOUBT_TIME | RAVENCAL_DOUBT_NOT_LATCHED | RAVENCAL_DOUBT_NOT_FINITE |
    RAVENCAL_DOUBT_OUT_OF_RANGE | RAVENCAL_DOUBT_WARMING_UP | RAVENCAL_DOUBT_MAGNITUDE |
    RAVENCAL_DOUBT_ENCODER_JUMP | RAVENCAL_DOUBT_DISTANCE | RAVENCAL_DOUBT_PEDAL;

/// The state in which a correction must not be applied, given what speaks against it.
std::int32_t resting_state(bool enabled, std::uint32_t doubts) noexcept {
  if ((doubts & RAVENCAL_DOUBT_NETWORK) != 0) return RAVENCAL_STATE_FAULT;
  if (!enabled) return RAVENCAL_STATE_OFF;
  constexpr std::uint32_t kNotReady = RAVENCAL_DOUBT_ROBOT_STATE | RAVENCAL_DOUBT_NO_WEIGHTS;
  return (doubts & kNotReady) != 0 ? RAVENCAL_STATE_ARMED : RAVENCAL_STATE_BYPASS;
}

}  // namespace

Envelope::Envelope(const ravencal_config& config) noexcept
    : clear_ticks_needed_(kClearNs / config.tick_ns),
      hold_ticks_allowed_(config.hold_ns / config.tick_ns) {
  // The tick's length is the configured one, never the measured one: late, early or frozen clocks
  // cannot enlarge a step.
  const double tick_s = static_cast<double>(config.tick_ns) * kSecondsPerNs;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    slew_step_ji_[j] = static_cast<float>(static_cast<double>(config.slew_ji_per_s[j]) * tick_s);
    rate_step_ji_[j] =
        static_cast<float>(static_cast<double>(config.max_correction_rate_ji_per_s[j]) * tick_s);
  }
}

std::int32_t Envelope::advance(bool enabled, std::uint32_t doubts,
                               const JointVector& wanted_ji) noexcept {
  clear_ticks_ = doubts == 0 ? clear_ticks_ + 1 : 0;
  // Doubts that come and go share one allowance, or a flickering one would be held for ever.
  if (clear_ticks_ > clear_ticks_needed_) hold_ticks_ = 0;
  const std::int32_t before = state_;
  state_ = next_state(enabled, doubts);
  if (state_ == RAVENCAL_STATE_FADING_OUT) {
    // A fault, once seen, outlives whatever follows it during the fade.
    const bool faulted = before == RAVENCAL_STATE_FADING_OUT && after_fade_ == RAVENCAL_STATE_FAULT;
    after_fade_ = faulted ? RAVENCAL_STATE_FAULT : resting_state(enabled, doubts);
  }

  limited_joints_ = 0;
  switch (state_) {
    case RAVENCAL_STATE_FADING_IN:
      if (move_towards(wanted_ji, slew_step_ji_) == 0) state_ = RAVENCAL_STATE_ACTIVE;
      return RAVENCAL_OK;
    case RAVENCAL_STATE_ACTIVE:
      limited_joints_ = move_towards(wanted_ji, rate_step_ji_);
      return RAVENCAL_OK;
    case RAVENCAL_STATE_HOLD:
      ++hold_ticks_;
      return RAVENCAL_HELD;
    case RAVENCAL_STATE_FADING_OUT:
      move_towards(JointVector{}, slew_step_ji_);
      if (!is_faded_out()) return RAVENCAL_HELD;
      state_ = after_fade_;
      break;
    default:
      break;
  }
  return state_ == RAVENCAL_STATE_FAULT ? RAVENCAL_FAULT : RAVENCAL_BYPASS;
}

std::int32_t Envelope::next_state(bool enabled, std::uint32_t doubts) const noexcept {
  const bool welcome = enabled && doubts == 0;
  const bool settled = welcome && clear_ticks_ > clear_ticks_needed_;
  switch (state_) {
    case RAVENCAL_STATE_FADING_IN:
    case RAVENCAL_STATE_ACTIVE:
      if (welcome) return state_;
      return may_hold(enabled, doubts) ? RAVENCAL_STATE_HOLD : RAVENCAL_STATE_FADING_OUT;
    case RAVENCAL_STATE_HOLD:
      if (welcome) return RAVENCAL_STATE_FADING_IN;
      return may_hold(enabled, doubts) ? RAVENCAL_STATE_HOLD : RAVENCAL_STATE_FADING_OUT;
    case RAVENCAL_STATE_FADING_OUT:
      return settled && after_fade_ != RAVENCAL_STATE_FAULT ? RAVENCAL_STATE_FADING_IN
                                                            : RAVENCAL_STATE_FADING_OUT;
    case RAVENCAL_STATE_FAULT:
      return RAVENCAL_STATE_FAULT;
    case RAVENCAL_STATE_OFF:
      // One tick in ARMED, whatever comes, so that every correction is seen to be armed first.
      return enabled ? RAVENCAL_STATE_ARMED : RAVENCAL_STATE_OFF;
    default:  // ARMED, BYPASS
      if (settled) return RAVENCAL_STATE_FADING_IN;
      return welcome ? state_ : resting_state(enabled, doubts);
  }
}

bool Envelope::may_hold(bool enabled, std::uint32_t doubts) const noexcept {
  return enabled && (doubts & ~kMayPass) == 0 && hold_ticks_ < hold_ticks_allowed_;
}

void Envelope::refade() noexcept {
  if (state_ == RAVENCAL_STATE_ACTIVE) state_ = RAVENCAL_STATE_FADING_IN;
}

void Envelope::reset() noexcept {
  if (state_ == RAVENCAL_STATE_FAULT) state_ = RAVENCAL_STATE_OFF;
  if (state_ == RAVENCAL_STATE_FADING_OUT) after_fade_ = RAVENCAL_STATE_OFF;
}

bool Envelope::is_faded_out() const noexcept {
  for (const float correction : correction_ji_) {
    if (correction != 0.0F) return false;
  }
  return true;
}

/// Moves each correction towards its target by at most its step; returns how many did not arrive.
std::uint32_t Envelope::move_towards(const JointVector& target_ji,
                                     const JointVector& step_ji) noexcept {
  std::uint32_t behind = 0;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    const float gap = target_ji[j] - correction_ji_[j];
    if (gap > step_ji[j]) {
      correction_ji_[j] += step_ji[j];
      ++behind;
    } else if (gap < -step_ji[j]) {
      correction_ji_[j] -= step_ji[j];
      ++behind;
    } else {
      correction_ji_[j] = target_ji[j];
    }
  }
  return behind;
}

}  // namespace ravencal::rt
