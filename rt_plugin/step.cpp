// SPDX-License-Identifier: Apache-2.0
//
// The hot path, in the order in which one sample travels. decide(): weights on offer -> what speaks
// against correcting (clock, channels, inputs, network, robot) -> envelope; write(): corrected
// joints; count(). Nothing below allocates, locks or calls the system.
#include "rt_plugin/step.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/constants.hpp"
#include "core/run_level.hpp"
#include "rt_plugin/telemetry_record.hpp"

namespace ravencal::rt {
namespace {

/// The published state must be that of the step before this one.
std::uint32_t doubt_latch(const ravencal_instance& self) noexcept {
  const bool current = self.has_published && self.guards.is_previous(self.published.t_ns);
  return current ? 0U : RAVENCAL_DOUBT_NOT_LATCHED;
}

/// How the time channel of a recording is meant: seconds since the work began.
float seconds_since_armed(const ravencal_instance& self, std::int64_t t_ns) noexcept {
  const auto elapsed_ns = static_cast<std::int64_t>(static_cast<std::uint64_t>(t_ns) -
                                                    static_cast<std::uint64_t>(self.armed_ns));
  return static_cast<float>(static_cast<double>(elapsed_ns) * core::kSecondsPerNs);
}

/// Asks the weights in use, if there are any, for the joint errors of this cycle.
LoadedModel::Prediction predict(ravencal_instance& self) noexcept {
  LoadedModel::Prediction prediction;
  LoadedModel* const model = self.models.current();
  if (model == nullptr) {
    prediction.doubts = RAVENCAL_DOUBT_NO_WEIGHTS;
    return prediction;
  }
  prediction = model->predict();
  if (model->info().needs_cycle_end != 0) prediction.doubts |= doubt_latch(self);
  prediction.doubts |= StateGuards::inspect_magnitude(prediction.error_ji, model->largest_ji());
  return prediction;
}

/// What one cycle came to.
struct Decision {
  LoadedModel::Prediction prediction;
  std::uint32_t doubts = 0;  ///< RAVENCAL_DOUBT_*
  std::int32_t status = RAVENCAL_BYPASS;
  bool swapped = false;
  bool rolled_back = false;
};

JointVector largest_ji(const ravencal_instance& self) noexcept {
  const LoadedModel* const model = self.models.current();
  return model == nullptr ? std::to_array(self.config.max_correction_ji) : model->largest_ji();
}

/// What the envelope may lead the correction to in this cycle.
CorrectionRequest request(const ravencal_instance& self, const ravencal_state& state,
                          const Decision& decision) noexcept {
  const LoadedModel* const model = self.models.current();
  const ravencal_arm& arm = state.arm[0];
  const bool latched = doubt_latch(self) == 0;
  const JointVector constant_ji = model == nullptr ? JointVector{} : model->constant_ji();
  const JointVector of_homing_ji = self.homing_constant.ji();
  CorrectionRequest asked{.confidence = decision.prediction.confidence,
                          .same_weights = !decision.swapped,
                          .motors_follow = StateGuards::motors_follow(state),
                          .is_init = state.runlevel == core::kInit,
                          .own_ji = {arm.jpos_ji[0], arm.jpos_ji[1], arm.jpos_ji[2]},
                          .commanded_ji = latched ? self.commanded.moved_ji() : JointVector{},
                          .travelled_ji = latched ? self.commanded.travelled_ji() : JointVector{},
                          .largest_ji = largest_ji(self),
                          .passed_ns = self.guards.passed_ns()};
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    const float share = self.operation.share_of(j);
    asked.predicted_ji[j] = share * (decision.prediction.error_ji[j] + of_homing_ji[j]);
    asked.constant_ji[j] = share * (constant_ji[j] + of_homing_ji[j]);
  }
  return asked;
}

Decision decide(ravencal_instance& self, const ravencal_state& state) noexcept {
  Decision decision;
  decision.doubts = self.guards.inspect(state);
  const bool motors_follow = StateGuards::motors_follow(state);
  self.requests.take(self.telemetry.requests(), motors_follow, self.operation,
                     self.homing_constant);
  const bool other_share = self.operation.advance(motors_follow, self.guards.has_stopped());
  const std::int32_t mode = self.operation.mode();
  if (self.operation.resets()) self.overruns.reset();
  if (self.envelope.begins(mode)) self.armed_ns = state.t_ns;

  if (self.overruns.exhausted()) decision.doubts |= RAVENCAL_DOUBT_OVERRUN;
  if (self.desired.press_is_doubted() && motors_follow) decision.doubts |= RAVENCAL_DOUBT_PRESS;
  if ((decision.doubts & RAVENCAL_DOUBT_TIME) != 0) self.models.forget_history();
  // Before the first published state, that at the hook is the nearest to it.
  const ravencal_state& published = self.has_published ? self.published : state;
  const bool other_weights =
      self.models.advance({state, published, seconds_since_armed(self, state.t_ns)});
  decision.swapped = other_weights;
  const bool other_constant =
      self.homing_constant.advance(state, weights_checksum(self), largest_ji(self));
  decision.prediction = predict(self);
  decision.doubts |= decision.prediction.doubts;
  CorrectionRequest asked = request(self, state, decision);
  asked.same_weights = asked.same_weights && !other_share && !other_constant;
  decision.status = self.envelope.advance({mode, decision.doubts, self.operation.resets()}, asked);
  if (decision.doubts == 0) self.models.note_sound_cycle();
  // Shown, but no reason to leave what is applied: that part is right.
  if (self.envelope.is_at_limit() || (motors_follow && self.desired.is_at_limit())) {
    decision.doubts |= RAVENCAL_DOUBT_LIMIT;
  }
  if (mode != RAVENCAL_MODE_OFF && (decision.doubts & RAVENCAL_DOUBT_NETWORK) != 0) {
    decision.rolled_back = self.models.roll_back();
  }
  return decision;
}

void note_transition(ravencal_counters& counters, const ravencal_state& state, std::int32_t from,
                     std::int32_t to, std::uint32_t doubts) noexcept {
  if (from == to) return;
  counters.last_transitions[counters.transitions % RAVENCAL_TRANSITIONS_KEPT] = {
      counters.ticks, state.t_ns, from, to, doubts, 0};
  ++counters.transitions;
}

void count(ravencal_instance& self, const ravencal_state& state, std::int32_t state_before,
           const Decision& decision, std::uint32_t step_ns) noexcept {
  ravencal_counters& counters = self.counters;
  const std::int32_t now = self.envelope.state();
  ++counters.ticks;
  ++counters.ticks_in_state[now];
  for (std::uint32_t kind = 0; kind < RAVENCAL_DOUBT_KINDS; ++kind) {
    counters.ticks_in_doubt[kind] += (decision.doubts >> kind) & 1U;
  }
  counters.clamped_inputs += decision.prediction.clamped_inputs;
  counters.limited_rate += self.envelope.limited_joints();
  counters.swaps += decision.swapped ? 1 : 0;
  counters.rollbacks += decision.rolled_back ? 1 : 0;
  counters.overruns += self.overruns.count(counters.ticks, step_ns) ? 1 : 0;
  if (step_ns > counters.longest_step_ns) counters.longest_step_ns = step_ns;
  note_transition(counters, state, state_before, now, decision.doubts);
  self.shared_counters.publish(counters);
}

DesiredJoints::Phase phase_of(const ravencal_state& state) noexcept {
  if (StateGuards::motors_follow(state)) return DesiredJoints::Phase::kFollows;
  return state.runlevel == core::kInit ? DesiredJoints::Phase::kInit : DesiredJoints::Phase::kFree;
}

/// Denormal numbers count as zero here, so the robot's own value is copied, never computed, where
/// it is to come back bit for bit.
void write(const ravencal_instance& self, const ravencal_state& state, const Decision& decision,
           ravencal_output& output) noexcept {
  const JointVector& correction_ji = self.envelope.correction_ji();
  output.state = self.envelope.state();
  output.doubts = decision.doubts;
  output.confidence = decision.prediction.confidence;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    const float own_ji = state.arm[0].jpos_ji[j];
    // Bit for bit the robot's own value without a correction: -0 + 0 would be +0. The same holds
    // where it is not a number: a sum would be another one.
    const bool corrected = correction_ji[j] != 0.0F && own_ji - own_ji == 0.0F;
    output.jpos_ji[j] = corrected ? own_ji + correction_ji[j] : own_ji;
    output.correction_ji[j] = correction_ji[j];
    output.predicted_ji[j] = decision.prediction.error_ji[j];
    output.offset_ji[j] = self.envelope.offset_ji()[j];
  }
}

}  // namespace

std::int32_t step(ravencal_instance& self, const ravencal_state& state,
                  ravencal_output& output) noexcept {
  const std::uint64_t start = Stopwatch::now();
  const std::int32_t state_before = self.envelope.state();
  const JointVector correction_before_ji = self.envelope.correction_ji();
  const Decision decision = decide(self, state);
  write(self, state, decision, output);
  const JointVector desired_ji = self.desired.at_hook(
      state.arm[0], correction_before_ji, self.envelope.correction_ji(), phase_of(state));
  if (output.struct_size >= offsetof(ravencal_output, would_be_ji)) {
    std::copy(desired_ji.begin(), desired_ji.end(), output.desired_ji);
  }
  if (output.struct_size >= sizeof output) {
    const JointVector& would_be_ji = self.envelope.would_be_ji();
    std::copy(would_be_ji.begin(), would_be_ji.end(), output.would_be_ji);
    output.would_be_state = self.envelope.would_be_state();
  }
  // What follows is bookkeeping, the same every time.
  output.step_ns = self.stopwatch.since_ns(start);
  count(self, state, state_before, decision, output.step_ns);
  record(self, state, output, output.step_ns);
  return decision.status;
}

JointVector motor_command_ji(ravencal_instance& self, const JointVector& desired_ji) noexcept {
  const JointVector& applied_ji = self.envelope.correction_ji();
  const JointVector part_ji = self.desired.correction_in(desired_ji, applied_ji);
  if (part_ji != applied_ji) self.envelope.keep_part(part_ji);
  return self.desired.send(desired_ji, applied_ji);
}

void observe_cycle_end(ravencal_instance& self, const ravencal_state& state) noexcept {
  self.published = state;
  self.has_published = true;
  self.commanded.update(state, self.envelope.correction_ji());
}

}  // namespace ravencal::rt
