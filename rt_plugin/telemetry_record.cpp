// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/telemetry_record.hpp"

namespace ravencal::rt {

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
  self.telemetry.write(tick, self.envelope.offset_ji(), self.counters, self.requests.taken());
}

}  // namespace ravencal::rt
