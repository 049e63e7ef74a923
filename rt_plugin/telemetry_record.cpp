// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/telemetry_record.hpp"

#include <algorithm>

namespace ravencal::rt {
namespace {

ravencal_telemetry_homing homing_of(const ravencal_instance& self,
                                    const ravencal_arm& arm) noexcept {
  ravencal_telemetry_homing homing{};
  homing.constant = self.homing_constant.in_force();
  std::copy_n(arm.enc_offset_counts, RAVENCAL_JOINTS, homing.enc_offset_counts);
  homing.is_homed = StateGuards::is_homed(arm) ? 1 : 0;
  homing.weights_checksum = weights_checksum(self);
  return homing;
}

}  // namespace

void record(ravencal_instance& self, const ravencal_state& state, const ravencal_output& output,
            std::uint32_t step_ns) noexcept {
  ravencal_tick tick{};
  tick.tick = self.counters.ticks;
  tick.t_ns = state.t_ns;
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    tick.jpos_ji[j] = state.arm[0].jpos_ji[j];
    tick.correction_ji[j] = self.envelope.would_be_ji()[j];
    tick.predicted_ji[j] = output.predicted_ji[j];
    tick.enc_counts[j] = state.arm[0].enc_counts[j];
  }
  tick.confidence = output.confidence;
  tick.runlevel = state.runlevel;
  tick.state = output.state;
  tick.doubts = output.doubts;
  tick.step_ns = step_ns;
  tick.would_be_state = self.envelope.would_be_state();
  self.flight.record(tick, self.envelope.faulted());
  self.telemetry.write(tick, self.envelope.offset_ji(), self.counters, self.requests.taken(),
                       homing_of(self, state.arm[0]));
}

}  // namespace ravencal::rt
