// SPDX-License-Identifier: Apache-2.0
//
// The hot path, in the order in which one sample travels. decide(): weights on offer -> what speaks
// against correcting (clock, channels, inputs, network, robot) -> envelope; write(): corrected
// joints; count(). Nothing below allocates, locks or calls the system.
#include "rt_plugin/step.hpp"

#include <atomic>
#include <cmath>

#include "rt_plugin/fp_mode.hpp"
#include "rt_plugin/telemetry_record.hpp"

namespace ravencal::rt {
namespace {

constexpr std::int32_t kPedalUp = 2;
constexpr std::int32_t kPedalDown = 3;
constexpr std::uint32_t kCalibratedJointsReady = (1U << RAVENCAL_JOINTS) - 1U;
constexpr double kSecondsPerNs = 1e-9;

/// The clock may be late by scheduling, but a gap of so many ticks is a jump.
constexpr std::int64_t kLongestGapTicks = 10;

/// One writer, any reader: a plain load and store, no locked instruction.
void add(std::uint64_t& counter, std::uint64_t count = 1) noexcept {
  const std::atomic_ref<std::uint64_t> shared(counter);
  shared.store(shared.load(std::memory_order_relaxed) + count, std::memory_order_relaxed);
}

/// Both pedal positions: the correction must not change when the pedal is pressed, because that is
/// when the controller re-seeds its desired joints from the measured ones. Not in E-stop (0) and
/// INIT (1): there the robot homes or its cables hang without torque.
std::uint32_t doubt_robot(const ravencal_state& state) noexcept {
  const bool running = state.runlevel == kPedalUp || state.runlevel == kPedalDown;
  const bool ready = (state.arm[0].joints_ready & kCalibratedJointsReady) == kCalibratedJointsReady;
  return running && ready ? 0U : RAVENCAL_DOUBT_ROBOT_STATE;
}

/// Time must advance from step to step, and not by much more than a tick.
std::uint32_t doubt_clock(const ravencal_instance& self, std::int64_t t_ns) noexcept {
  if (!self.has_stepped) return 0;
  // Unsigned subtraction is defined for every pair of times; a step back becomes a huge gap.
  const std::uint64_t gap_ns =
      static_cast<std::uint64_t>(t_ns) - static_cast<std::uint64_t>(self.last_step_ns);
  const std::uint64_t longest_ns =
      static_cast<std::uint64_t>(kLongestGapTicks) * self.config.tick_ns;
  return gap_ns == 0 || gap_ns > longest_ns ? RAVENCAL_DOUBT_TIME : 0U;
}

/// The published state must be that of the step before this one.
std::uint32_t doubt_latch(const ravencal_instance& self) noexcept {
  const bool current =
      self.has_published && self.has_stepped && self.published.t_ns == self.last_step_ns;
  return current ? 0U : RAVENCAL_DOUBT_NOT_LATCHED;
}

/// How the time channel of a recording is meant: seconds since the work began.
float seconds_since_armed(const ravencal_instance& self, std::int64_t t_ns) noexcept {
  const auto elapsed_ns = static_cast<std::int64_t>(static_cast<std::uint64_t>(t_ns) -
                                                    static_cast<std::uint64_t>(self.armed_ns));
  return static_cast<float>(static_cast<double>(elapsed_ns) * kSecondsPerNs);
}

std::uint32_t doubt_magnitude(const ravencal_instance& self, const JointVector& error_ji) noexcept {
  bool too_large = false;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    too_large = too_large || std::fabs(error_ji[j]) > self.config.max_correction_ji[j];
  }
  return too_large ? RAVENCAL_DOUBT_MAGNITUDE : 0U;
}

/// Asks the model, if there is one, for the joint errors of this cycle.
LoadedModel::Prediction predict(ravencal_instance& self, const ravencal_state& state,
                                bool clock_jumped) noexcept {
  LoadedModel::Prediction prediction;
  if (self.model == nullptr) {
    prediction.doubts = RAVENCAL_DOUBT_NO_WEIGHTS;
    return prediction;
  }
  if (clock_jumped) self.model->forget_history();
  prediction = self.model->predict(state, self.published, seconds_since_armed(self, state.t_ns));
  if (self.model->info().needs_cycle_end != 0) prediction.doubts |= doubt_latch(self);
  prediction.doubts |= doubt_magnitude(self, prediction.error_ji);
  return prediction;
}

/// What one cycle came to.
struct Decision {
  LoadedModel::Prediction prediction;
  std::uint32_t doubts = 0;  ///< RAVENCAL_DOUBT_*
  std::int32_t status = RAVENCAL_BYPASS;
};

Decision decide(ravencal_instance& self, const ravencal_state& state) noexcept {
  const FlushDenormals flush_denormals;

  if (self.reset_requested.load(std::memory_order_relaxed) != 0) {
    self.reset_requested.store(0, std::memory_order_relaxed);
    self.envelope.reset();
  }
  if (self.swap.take(self.model)) {
    self.envelope.refade();
    add(self.counters.swaps);
  }
  const bool enabled = self.enabled.load(std::memory_order_relaxed) != 0;
  if (enabled && self.envelope.state() == RAVENCAL_STATE_OFF) self.armed_ns = state.t_ns;

  Decision decision;
  const std::uint32_t clock_doubt = doubt_clock(self, state.t_ns);
  decision.prediction = predict(self, state, clock_doubt != 0);
  decision.doubts = doubt_robot(state) | clock_doubt | decision.prediction.doubts;
  decision.status = self.envelope.advance(enabled, decision.doubts, decision.prediction.error_ji);
  return decision;
}

void count(ravencal_instance& self, std::int32_t state_before, const Decision& decision) noexcept {
  ravencal_counters& counters = self.counters;
  const std::int32_t state = self.envelope.state();
  add(counters.ticks);
  add(counters.ticks_in_state[state]);
  add(counters.transitions, state == state_before ? 0 : 1);
  for (std::uint32_t kind = 0; kind < RAVENCAL_DOUBT_KINDS; ++kind) {
    add(counters.ticks_in_doubt[kind], (decision.doubts >> kind) & 1U);
  }
  add(counters.clamped_inputs, decision.prediction.clamped_inputs);
  add(counters.limited_rate, self.envelope.limited_joints());
}

/// In the caller's floating-point mode: the robot's own value leaves as it came, denormal or not.
void write(const ravencal_instance& self, const ravencal_state& state, const Decision& decision,
           ravencal_output& output) noexcept {
  const JointVector& correction_ji = self.envelope.correction_ji();
  output.state = self.envelope.state();
  output.doubts = decision.doubts;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    const float own_ji = state.arm[0].jpos_ji[j];
    // Bit for bit the robot's own value without a correction: -0 + 0 would be +0.
    output.jpos_ji[j] = correction_ji[j] == 0.0F ? own_ji : own_ji + correction_ji[j];
    output.correction_ji[j] = correction_ji[j];
    output.predicted_ji[j] = decision.prediction.error_ji[j];
  }
}

}  // namespace

std::int32_t step(ravencal_instance& self, const ravencal_state& state,
                  ravencal_output& output) noexcept {
  const std::int32_t state_before = self.envelope.state();
  const Decision decision = decide(self, state);
  write(self, state, decision, output);
  count(self, state_before, decision);
  record(self, state, output, output.step_ns);
  self.last_step_ns = state.t_ns;
  self.has_stepped = true;
  return decision.status;
}

void observe_cycle_end(ravencal_instance& self, const ravencal_state& state) noexcept {
  self.published = state;
  self.has_published = true;
}

}  // namespace ravencal::rt
