// SPDX-License-Identifier: Apache-2.0
#include "rt/witness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/run_level.hpp"
#include "plugin_host/plugin_library.hpp"

namespace ravencal::test {
namespace {

bool is_at_zero(std::int32_t state) {
  return state == RAVENCAL_STATE_OFF || state == RAVENCAL_STATE_ARMED ||
         state == RAVENCAL_STATE_FAULT || state == RAVENCAL_STATE_SHADOW;
}

bool follows_prediction(std::int32_t state) {
  return state == RAVENCAL_STATE_FADING_IN || state == RAVENCAL_STATE_ACTIVE;
}

/// From which state the next tick may show which: the fades of a tick may end in it.
bool may_follow(std::int32_t from, std::int32_t to) {
  switch (to) {
    case RAVENCAL_STATE_FADING_IN:
    case RAVENCAL_STATE_ACTIVE:
      return from != RAVENCAL_STATE_OFF && from != RAVENCAL_STATE_FAULT;
    case RAVENCAL_STATE_HOLD:
      return follows_prediction(from);
    case RAVENCAL_STATE_FADING_OUT:
      return !is_at_zero(from);
    case RAVENCAL_STATE_FAULT:
      return from != RAVENCAL_STATE_OFF;
    default:
      return true;
  }
}

}  // namespace

/// How far a desired joint moved in the tick before this one, with the pedal down.
double Witness::commanded_ji(std::size_t joint) const {
  const double moved = std::abs(desired_[0].ji[joint] - desired_[1].ji[joint]);
  const bool counts = desired_[0].pedal_down && desired_[1].pedal_down && std::isfinite(moved);
  return counts ? moved : 0.0;
}

std::string Witness::see_joint(std::size_t joint, const ravencal_state& state,
                               const ravencal_output& output) {
  const float own_ji = state.arm[0].jpos_ji[joint];
  const float correction_ji = output.correction_ji[joint];
  const auto now = static_cast<double>(correction_ji);
  const double step = std::abs(now - before_[joint]);
  before_[joint] = now;
  if (!std::isfinite(correction_ji) || !std::isfinite(output.predicted_ji[joint])) {
    return "a correction or prediction is no number";
  }
  const double passed_s = static_cast<double>(passed_ns_) * 1e-9;
  const bool goes_on =
      output.state == RAVENCAL_STATE_ACTIVE && state_before_ == RAVENCAL_STATE_ACTIVE;
  const auto rate = static_cast<double>(goes_on ? config_.max_correction_rate_ji_per_s[joint]
                                                : config_.slew_ji_per_s[joint]);
  // Rounding: a few units in the last place of the correction.
  const bool drops = state.runlevel == core::kInit && correction_ji == 0.0F;
  if (!drops && step > rate * passed_s * 1.0001 + 1e-8)
    return fmt::format("the correction stepped by {} in {} ns", step, passed_ns_);
  if (output.state == RAVENCAL_STATE_HOLD && step != 0.0) return "the correction moved in HOLD";
  if (state.runlevel == core::kPedalDown && !follows_prediction(output.state) && step != 0.0) {
    return "the correction moved by itself with the pedal down";
  }
  const double share = static_cast<double>(config_.follow_share) * commanded_ji(joint);
  if (knows_commands_ && state.runlevel == core::kPedalDown && step > share * 1.0001 + 1e-7) {
    return fmt::format("the correction moved by {} where {} were commanded", step,
                       commanded_ji(joint));
  }
  if (is_at_zero(output.state) && correction_ji != 0.0F) return "a correction where none may be";
  if (std::abs(now) > static_cast<double>(config_.max_correction_ji[joint]) * 1.0001) {
    return fmt::format("a correction of {}", now);
  }
  const bool own = correction_ji == 0.0F || !std::isfinite(own_ji);
  const float expected = own ? own_ji : own_ji + correction_ji;
  if (std::bit_cast<std::uint32_t>(expected) !=
      std::bit_cast<std::uint32_t>(output.jpos_ji[joint])) {
    return fmt::format("the output is {}, not {}", output.jpos_ji[joint], expected);
  }
  return {};
}

std::string Witness::see(const ravencal_state& state, const ravencal_output& output) {
  ++ticks_;
  // What passes by the robot's clock, but at most a tick. Times may be any numbers.
  const auto advanced = static_cast<std::int64_t>(static_cast<std::uint64_t>(state.t_ns) -
                                                  static_cast<std::uint64_t>(t_ns_before_));
  passed_ns_ = std::clamp<std::int64_t>(advanced, 0, config_.tick_ns);
  t_ns_before_ = state.t_ns;
  if (output.state < 0 || output.state >= RAVENCAL_STATE_COUNT) return "an unknown state";
  ++ticks_in_state_[static_cast<std::size_t>(output.state)];
  for (std::size_t kind = 0; kind < ticks_in_doubt_.size(); ++kind) {
    ticks_in_doubt_[kind] += (output.doubts >> kind) & 1U;
  }
  std::string wrong;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    const std::string of_joint = see_joint(j, state, output);
    if (wrong.empty() && !of_joint.empty()) wrong = fmt::format("joint {}: {}", j + 1, of_joint);
  }
  if (!(output.confidence >= 0.0F && output.confidence <= 1.0F))
    wrong = "a confidence out of range";
  if (output.state != state_before_) {
    ++transitions_;
    if (!may_follow(state_before_, output.state)) {
      wrong = fmt::format("{} followed {}", plugin_host::state_name(output.state),
                          plugin_host::state_name(state_before_));
    }
  }
  state_before_ = output.state;
  desired_[1] = desired_[0];
  desired_[0].pedal_down = state.runlevel == core::kPedalDown;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    desired_[0].ji[j] = static_cast<double>(state.arm[0].jpos_d_ji[j]) +
                        static_cast<double>(output.correction_ji[j]);
  }
  return wrong.empty() ? wrong
                       : fmt::format("tick {}, {}, doubts {:#x}: {}", ticks_,
                                     plugin_host::state_name(output.state), output.doubts, wrong);
}

std::string Witness::check(const ravencal_counters& counters) const {
  if (counters.ticks != ticks_) return fmt::format("{} ticks, not {}", counters.ticks, ticks_);
  if (counters.transitions != transitions_) {
    return fmt::format("{} transitions, not {}", counters.transitions, transitions_);
  }
  if (!std::equal(ticks_in_state_.begin(), ticks_in_state_.end(), counters.ticks_in_state)) {
    return "ticks in states";
  }
  if (!std::equal(ticks_in_doubt_.begin(), ticks_in_doubt_.end(), counters.ticks_in_doubt)) {
    return "ticks in doubts";
  }
  return {};
}

}  // namespace ravencal::test
