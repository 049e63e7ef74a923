// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/envelope.hpp"

#include <algorithm>

#include "core/constants.hpp"

namespace ravencal::rt {
namespace {

/// Doubts about a cycle or a few, during which the correction may stay where it is. The others are
/// about the robot, the weights or the plugin itself, and end it at once.
constexpr std::uint32_t kMayPass = RAVENCAL_DOUBT_TIME | RAVENCAL_DOUBT_NOT_LATCHED |
                                   RAVENCAL_DOUBT_NOT_FINITE | RAVENCAL_DOUBT_OUT_OF_RANGE |
                                   RAVENCAL_DOUBT_WARMING_UP | RAVENCAL_DOUBT_MAGNITUDE |
                                   RAVENCAL_DOUBT_ENCODER_JUMP | RAVENCAL_DOUBT_DISTANCE |
                                   RAVENCAL_DOUBT_PEDAL | RAVENCAL_DOUBT_PRESS;

/// What a state lets the correction do, and what step returns in it: the table of ABI.md.
struct Rule {
  Allowed free;     ///< pedal up, E-stop
  Allowed follows;  ///< pedal down
  std::int32_t status;
};
constexpr Rule kRules[RAVENCAL_STATE_COUNT] = {
    {Allowed::kNone, Allowed::kNone, RAVENCAL_BYPASS},   // OFF
    {Allowed::kNone, Allowed::kNone, RAVENCAL_BYPASS},   // ARMED
    {Allowed::kFollow, Allowed::kFollow, RAVENCAL_OK},   // FADING_IN
    {Allowed::kFollow, Allowed::kFollow, RAVENCAL_OK},   // ACTIVE
    {Allowed::kStay, Allowed::kStay, RAVENCAL_HELD},     // HOLD
    {Allowed::kShrink, Allowed::kStay, RAVENCAL_HELD},   // FADING_OUT
    {Allowed::kShrink, Allowed::kStay, RAVENCAL_HELD},   // CONSTANT
    {Allowed::kNone, Allowed::kNone, RAVENCAL_FAULT},    // FAULT
    {Allowed::kNone, Allowed::kNone, RAVENCAL_BYPASS}};  // SHADOW

/// In INIT there is none: homing takes what it reads and writes to be the motors' own.
Allowed allowed_in(std::int32_t state, const CorrectionRequest& request) noexcept {
  if (request.is_init) return Allowed::kNone;
  const Rule& rule = kRules[state];
  return request.motors_follow ? rule.follows : rule.free;
}

/// The state in which the prediction must not be applied, given what speaks against it.
std::int32_t resting_state(bool enabled, std::uint32_t doubts) noexcept {
  if ((doubts & RAVENCAL_DOUBT_NETWORK) != 0) return RAVENCAL_STATE_FAULT;
  if (!enabled) return RAVENCAL_STATE_OFF;
  constexpr std::uint32_t kNotReady = RAVENCAL_DOUBT_ROBOT_STATE | RAVENCAL_DOUBT_NO_WEIGHTS;
  return (doubts & kNotReady) != 0 ? RAVENCAL_STATE_ARMED : RAVENCAL_STATE_CONSTANT;
}

bool follows_prediction(std::int32_t state) noexcept {
  return state == RAVENCAL_STATE_FADING_IN || state == RAVENCAL_STATE_ACTIVE;
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
      follow_share_(config.follow_share),
      range_(config),
      transfer_(config.blend_share, per_tick(config.blend_ji_per_s, config.tick_ns)),
      tick_ns_(config.tick_ns),
      hold_ticks_allowed_(config.hold_ns / config.tick_ns) {}

std::int32_t Envelope::advance(const Asked& asked, const CorrectionRequest& request) noexcept {
  // SHADOW begins and ends without a correction: one in force fades out first, and what was only
  // shown is not there to go on from.
  const bool wants_shadow = asked.mode == RAVENCAL_MODE_SHADOW;
  const bool rests = state_ == RAVENCAL_STATE_OFF || state_ == RAVENCAL_STATE_ARMED;
  const bool turns = wants_shadow ? !is_shadow_ && rests : is_shadow_;
  is_shadow_ = is_shadow_ != turns;
  const bool enabled = asked.mode != RAVENCAL_MODE_OFF && wants_shadow == is_shadow_;

  clear_ns_ = asked.doubts == 0 ? clear_ns_ + request.passed_ns : 0;
  // Doubts that come and go share one allowance, or a flickering one would be held for ever.
  if (is_clear()) hold_ticks_ = 0;

  // A fault, once seen, outlives whatever follows it during the fade.
  const bool faulted = faults_after_fade() && !asked.reset;
  const bool recovers = asked.reset && state_ == RAVENCAL_STATE_FAULT;
  const bool begins_anew = recovers || (turns && state_ != RAVENCAL_STATE_FAULT);
  const std::int32_t before = begins_anew ? RAVENCAL_STATE_OFF : state_;
  const bool may_begin = enabled && !faulted;
  const std::int32_t called = next_state(before, may_begin, asked.doubts, request.motors_follow);
  after_fade_ = faulted ? RAVENCAL_STATE_FAULT : resting_state(enabled, asked.doubts);
  hold_ticks_ += called == RAVENCAL_STATE_HOLD && !request.motors_follow ? 1 : 0;

  const Way way = way_in(called, request);
  const std::uint32_t behind =
      correction_.move(allowed_in(called, request), way.target_ji, way.step_ji, request.largest_ji);
  is_at_limit_ = keep_in_range(request);

  std::int32_t reached = called;
  limited_joints_ = 0;
  if (follows_prediction(called)) {
    limited_joints_ = way.fades ? 0 : behind;
    const bool arrived = way.is_whole && behind == 0;
    const bool is_active = (arrived || !way.fades) && !is_at_limit_;
    reached = is_active ? RAVENCAL_STATE_ACTIVE : RAVENCAL_STATE_FADING_IN;
  } else if (called == RAVENCAL_STATE_FADING_OUT && behind == 0) {
    reached = after_fade_;
  }
  state_ = reached;
  return kRules[state()].status;
}

/// The desired joints move with the correction, so that it may change by any step here. With the
/// pedal down it is not touched: commands end at the limit.
bool Envelope::keep_in_range(const CorrectionRequest& request) noexcept {
  JointVector allowed_ji = correction_.ji();
  for (std::size_t j = 0; j < RAVENCAL_JOINTS && !request.motors_follow; ++j) {
    allowed_ji[j] = range_.allowed_ji(j, request.own_ji[j], allowed_ji[j]);
  }
  return correction_.keep_part(allowed_ji);
}

void Envelope::keep_part(const JointVector& correction_ji) noexcept {
  correction_.keep_part(correction_ji);
  transfer_.forget();
}

std::int32_t Envelope::next_state(std::int32_t before, bool enabled, std::uint32_t doubts,
                                  bool motors_follow) const noexcept {
  const bool welcome = enabled && doubts == 0;
  const bool settled = welcome && is_clear();
  switch (before) {
    case RAVENCAL_STATE_FADING_IN:
    case RAVENCAL_STATE_ACTIVE:
    case RAVENCAL_STATE_HOLD:
      if (welcome) return before == RAVENCAL_STATE_HOLD ? RAVENCAL_STATE_FADING_IN : before;
      return may_hold(enabled, doubts, motors_follow) ? RAVENCAL_STATE_HOLD
                                                      : RAVENCAL_STATE_FADING_OUT;
    case RAVENCAL_STATE_FADING_OUT:
      return settled ? RAVENCAL_STATE_FADING_IN : RAVENCAL_STATE_FADING_OUT;
    case RAVENCAL_STATE_FAULT:
      return RAVENCAL_STATE_FAULT;
    case RAVENCAL_STATE_OFF:
      // One tick in ARMED, whatever comes, so that every correction is seen to be armed first.
      return enabled ? RAVENCAL_STATE_ARMED : RAVENCAL_STATE_OFF;
    default: {  // ARMED, CONSTANT
      if (settled) return RAVENCAL_STATE_FADING_IN;
      if (welcome) return before;
      const std::int32_t resting = resting_state(enabled, doubts);
      if (resting == RAVENCAL_STATE_CONSTANT) return before;
      return RAVENCAL_STATE_FADING_OUT;
    }
  }
}

/// With the pedal down a doubt that may pass is held until it has passed or the pedal is up.
bool Envelope::may_hold(bool enabled, std::uint32_t doubts, bool motors_follow) const noexcept {
  return enabled && (doubts & ~kMayPass) == 0 &&
         (motors_follow || hold_ticks_ < hold_ticks_allowed_);
}

/// The same instructions whatever the state is, but for the transfer.
Envelope::Way Envelope::way_in(std::int32_t state, const CorrectionRequest& request) noexcept {
  const float passed_ticks = static_cast<float>(request.passed_ns) / static_cast<float>(tick_ns_);
  const bool is_correcting = follows_prediction(state);
  const bool is_led = is_correcting && request.motors_follow;
  Way way;
  if (is_led) {
    way.target_ji = transfer_.follow(request, correction_.ji(), passed_ticks);
  } else {
    transfer_.forget();
    const bool keeps_constant =
        state == RAVENCAL_STATE_CONSTANT ||
        (state == RAVENCAL_STATE_FADING_OUT && after_fade_ == RAVENCAL_STATE_CONSTANT);
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      const float rest_ji = keeps_constant ? request.constant_ji[j] : 0.0F;
      way.target_ji[j] = is_correcting ? request.requested_ji(j) : rest_ji;
    }
  }
  way.is_whole = transfer_.offset_ji() == kNone;
  // A prediction of other weights is reached by the slew, not by the rate.
  way.fades = state != RAVENCAL_STATE_ACTIVE || !way.is_whole || !request.same_weights;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    const float slew_ji = slew_per_tick_ji_[j] * passed_ticks;
    const float rate_ji = rate_per_tick_ji_[j] * passed_ticks;
    const float led_ji = std::min(rate_ji, follow_share_ * request.commanded_ji[j]);
    way.step_ji[j] = is_led ? led_ji : way.fades ? slew_ji : rate_ji;
  }
  return way;
}

}  // namespace ravencal::rt
