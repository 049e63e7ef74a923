// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/envelope.hpp"
#include "core/constants.hpp"

#include <algorithm>

namespace ravencal::rt {
namespace {

/// Doubts about a cycle or a few, during which the correction may stay where it is. The others are
/// about the robot, the weights or the plugin itself, and end it at once.
constexpr std::uint32_t kMayPass = RAVENCAL_DOUBT_TIME | RAVENCAL_DOUBT_NOT_LATCHED |
                                   RAVENCAL_DOUBT_NOT_FINITE | RAVENCAL_DOUBT_OUT_OF_RANGE |
                                   RAVENCAL_DOUBT_WARMING_UP | RAVENCAL_DOUBT_MAGNITUDE |
                                   RAVENCAL_DOUBT_ENCODER_JUMP | RAVENCAL_DOUBT_DISTANCE |
                                   RAVENCAL_DOUBT_PEDAL | RAVENCAL_DOUBT_PRESS;

/// The state in which the prediction must not be applied, given what speaks against it.
std::int32_t resting_state(bool enabled, std::uint32_t doubts) noexcept {
  if ((doubts & RAVENCAL_DOUBT_NETWORK) != 0) return RAVENCAL_STATE_FAULT;
  if (!enabled) return RAVENCAL_STATE_OFF;
  constexpr std::uint32_t kNotReady = RAVENCAL_DOUBT_ROBOT_STATE | RAVENCAL_DOUBT_NO_WEIGHTS;
  return (doubts & kNotReady) != 0 ? RAVENCAL_STATE_ARMED : RAVENCAL_STATE_CONSTANT;
}

/// What step returns in a resting state.
std::int32_t status_of(std::int32_t resting) noexcept {
  if (resting == RAVENCAL_STATE_FAULT) return RAVENCAL_FAULT;
  return resting == RAVENCAL_STATE_CONSTANT ? RAVENCAL_HELD : RAVENCAL_BYPASS;
}

/// So many joint units per second are so many per tick of the configured length.
JointVector per_tick(const float (&per_s)[RAVENCAL_JOINTS], std::uint32_t tick_ns) noexcept {
  const double tick_s = static_cast<double>(tick_ns) * core::kSecondsPerNs;
  JointVector step{};
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    step[j] = static_cast<float>(static_cast<double>(per_s[j]) * tick_s);
  }
  return step;
}

}  // namespace

Envelope::Envelope(const ravencal_config& config) noexcept
    : slew_per_tick_ji_(per_tick(config.slew_ji_per_s, config.tick_ns)),
      rate_per_tick_ji_(per_tick(config.max_correction_rate_ji_per_s, config.tick_ns)),
      max_correction_ji_(std::to_array(config.max_correction_ji)),
      follow_share_(config.follow_share),
      range_(config),
      transfer_(config.blend_share, per_tick(config.blend_ji_per_s, config.tick_ns)),
      tick_ns_(config.tick_ns),
      hold_ticks_allowed_(config.hold_ns / config.tick_ns) {}

std::int32_t Envelope::advance(bool enabled, std::uint32_t doubts,
                               const CorrectionRequest& request) noexcept {
  const std::int32_t status = move(enabled, doubts, request);
  keep_in_range(request);
  return status;
}

/// The desired joints move with the correction, so that it may change by any step here. With the
/// pedal down it is not touched: commands end at the limit.
void Envelope::keep_in_range(const CorrectionRequest& request) noexcept {
  is_at_limit_ = false;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    const float allowed_ji = range_.allowed_ji(j, request.own_ji[j], correction_ji_[j]);
    const bool beyond = !request.motors_follow & (allowed_ji != correction_ji_[j]);
    const float choice_ji[2] = {correction_ji_[j], allowed_ji};
    correction_ji_[j] = choice_ji[beyond ? 1 : 0];
    is_at_limit_ = is_at_limit_ | beyond;
  }
  if (is_at_limit_ && state_ == RAVENCAL_STATE_ACTIVE) state_ = RAVENCAL_STATE_FADING_IN;
}

void Envelope::take(const JointVector& correction_ji) noexcept {
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    correction_ji_[j] = std::clamp(correction_ji[j], -max_correction_ji_[j], max_correction_ji_[j]);
  }
  transfer_.forget();
}

std::int32_t Envelope::move(bool enabled, std::uint32_t doubts,
                            const CorrectionRequest& request) noexcept {
  measure_steps(request.passed_ns);
  clear_ns_ = doubts == 0 ? clear_ns_ + request.passed_ns : 0;
  // Doubts that come and go share one allowance, or a flickering one would be held for ever.
  if (is_clear()) hold_ticks_ = 0;
  const std::int32_t before = state_;
  state_ = next_state(enabled, doubts, request.motors_follow);
  limited_joints_ = 0;
  if (state_ == RAVENCAL_STATE_FADING_IN || state_ == RAVENCAL_STATE_ACTIVE) {
    correct(request);
    return RAVENCAL_OK;
  }
  transfer_.forget();
  if (state_ == RAVENCAL_STATE_HOLD) {
    hold_ticks_ += request.motors_follow ? 0 : 1;
    return RAVENCAL_HELD;
  }
  if (state_ == RAVENCAL_STATE_FADING_OUT) {
    // A fault, once seen, outlives whatever follows it during the fade.
    const bool faulted = before == RAVENCAL_STATE_FADING_OUT && after_fade_ == RAVENCAL_STATE_FAULT;
    after_fade_ = faulted ? RAVENCAL_STATE_FAULT : resting_state(enabled, doubts);
    return fade_out(request);
  }
  if (state_ == RAVENCAL_STATE_CONSTANT && !request.motors_follow) {
    move_towards(request.constant_ji, slew_step_ji_);
  }
  return status_of(state_);
}

/// In every state, so that a tick takes the same instructions whatever its state is.
void Envelope::measure_steps(std::uint32_t passed_ns) noexcept {
  passed_ticks_ = static_cast<float>(passed_ns) / static_cast<float>(tick_ns_);
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    slew_step_ji_[j] = slew_per_tick_ji_[j] * passed_ticks_;
    rate_step_ji_[j] = rate_per_tick_ji_[j] * passed_ticks_;
  }
}

std::int32_t Envelope::next_state(bool enabled, std::uint32_t doubts,
                                  bool motors_follow) const noexcept {
  const bool welcome = enabled && doubts == 0;
  const bool settled = welcome && is_clear();
  switch (state_) {
    case RAVENCAL_STATE_FADING_IN:
    case RAVENCAL_STATE_ACTIVE:
      if (welcome) return state_;
      return may_hold(enabled, doubts, motors_follow) ? RAVENCAL_STATE_HOLD
                                                      : RAVENCAL_STATE_FADING_OUT;
    case RAVENCAL_STATE_HOLD:
      if (welcome) return RAVENCAL_STATE_FADING_IN;
      return may_hold(enabled, doubts, motors_follow) ? RAVENCAL_STATE_HOLD
                                                      : RAVENCAL_STATE_FADING_OUT;
    case RAVENCAL_STATE_FADING_OUT:
      return settled && after_fade_ != RAVENCAL_STATE_FAULT ? RAVENCAL_STATE_FADING_IN
                                                            : RAVENCAL_STATE_FADING_OUT;
    case RAVENCAL_STATE_FAULT:
      return RAVENCAL_STATE_FAULT;
    case RAVENCAL_STATE_OFF:
      // One tick in ARMED, whatever comes, so that every correction is seen to be armed first.
      return enabled ? RAVENCAL_STATE_ARMED : RAVENCAL_STATE_OFF;
    default:  // ARMED, CONSTANT
      if (settled) return RAVENCAL_STATE_FADING_IN;
      return welcome ? state_ : way_to(resting_state(enabled, doubts));
  }
}

/// With the pedal down a doubt that may pass is held until it has passed or the pedal is up.
bool Envelope::may_hold(bool enabled, std::uint32_t doubts, bool motors_follow) const noexcept {
  return enabled && (doubts & ~kMayPass) == 0 &&
         (motors_follow || hold_ticks_ < hold_ticks_allowed_);
}

std::int32_t Envelope::way_to(std::int32_t resting) const noexcept {
  const bool is_there = resting == RAVENCAL_STATE_CONSTANT || correction_ji_ == JointVector{};
  return is_there ? resting : RAVENCAL_STATE_FADING_OUT;
}

void Envelope::reset() noexcept {
  if (state_ == RAVENCAL_STATE_FAULT) state_ = RAVENCAL_STATE_OFF;
  if (state_ == RAVENCAL_STATE_FADING_OUT) after_fade_ = RAVENCAL_STATE_OFF;
}

void Envelope::correct(const CorrectionRequest& request) noexcept {
  JointVector target_ji{};
  JointVector led_ji;
  const JointVector* step_ji = &rate_step_ji_;
  if (request.motors_follow) {
    target_ji = transfer_.follow(request, correction_ji_, passed_ticks_);
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      led_ji[j] = std::min(rate_step_ji_[j], follow_share_ * request.commanded_ji[j]);
    }
    step_ji = &led_ji;
  } else {
    transfer_.forget();
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) target_ji[j] = request.requested_ji(j);
  }
  // A prediction of other weights is reached by the slew, not by the rate.
  const bool whole = transfer_.offset_ji() == JointVector{};
  if (!whole || !request.same_weights) state_ = RAVENCAL_STATE_FADING_IN;
  if (state_ == RAVENCAL_STATE_FADING_IN && !request.motors_follow) step_ji = &slew_step_ji_;
  const std::uint32_t behind = move_towards(target_ji, *step_ji);
  if (state_ == RAVENCAL_STATE_ACTIVE) limited_joints_ = behind;
  if (whole && behind == 0) state_ = RAVENCAL_STATE_ACTIVE;
}

/// Towards the constant part or zero; with the pedal down, only once it is up.
std::int32_t Envelope::fade_out(const CorrectionRequest& request) noexcept {
  const JointVector rest_ji =
      after_fade_ == RAVENCAL_STATE_CONSTANT ? request.constant_ji : JointVector{};
  if (!request.motors_follow) move_towards(rest_ji, slew_step_ji_);
  // Homing takes what it writes and reads to be the motors' own, from its first cycle on.
  if (request.is_init) correction_ji_ = rest_ji;
  if (correction_ji_ != rest_ji) return RAVENCAL_HELD;
  state_ = after_fade_;
  return status_of(state_);
}

/// Moves each correction towards its target, within its limit, by at most its step; returns how
/// many did not arrive.
std::uint32_t Envelope::move_towards(const JointVector& target_ji,
                                     const JointVector& step_ji) noexcept {
  std::uint32_t behind = 0;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    const float reachable_ji =
        std::clamp(target_ji[j], -max_correction_ji_[j], max_correction_ji_[j]);
    const float gap_ji = reachable_ji - correction_ji_[j];
    if (gap_ji > step_ji[j]) {
      correction_ji_[j] += step_ji[j];
      ++behind;
    } else if (gap_ji < -step_ji[j]) {
      correction_ji_[j] -= step_ji[j];
      ++behind;
    } else {
      correction_ji_[j] = reachable_ji;
    }
  }
  return behind;
}

}  // namespace ravencal::rt
