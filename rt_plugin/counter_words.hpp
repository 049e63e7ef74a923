// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "ravencal/plugin.h"
#include "rt_plugin/telemetry_words.hpp"

namespace ravencal::rt {

/// Of a kilobyte of counters, stores only what a tick can have changed: what is counted, and the
/// newest transition. The same work whatever they hold.
inline void store_counted(std::uint64_t* to, const ravencal_counters& counters) noexcept {
  const auto at = [&](std::size_t byte) -> std::uint64_t& { return to[byte / sizeof *to]; };
  store_word(at(offsetof(ravencal_counters, ticks)), counters.ticks);
  std::uint64_t* const in_state = &at(offsetof(ravencal_counters, ticks_in_state));
  for (std::size_t i = 0; i < RAVENCAL_STATE_COUNT; ++i) {
    store_word(in_state[i], counters.ticks_in_state[i]);
  }
  std::uint64_t* const in_doubt = &at(offsetof(ravencal_counters, ticks_in_doubt));
  for (std::size_t i = 0; i < RAVENCAL_DOUBT_KINDS; ++i) {
    store_word(in_doubt[i], counters.ticks_in_doubt[i]);
  }
  store_word(at(offsetof(ravencal_counters, clamped_inputs)), counters.clamped_inputs);
  store_word(at(offsetof(ravencal_counters, limited_rate)), counters.limited_rate);
  store_word(at(offsetof(ravencal_counters, swaps)), counters.swaps);
  store_word(at(offsetof(ravencal_counters, rollbacks)), counters.rollbacks);
  store_word(at(offsetof(ravencal_counters, overruns)), counters.overruns);
  store_word(at(offsetof(ravencal_counters, longest_step_ns)), counters.longest_step_ns);
  store_word(at(offsetof(ravencal_counters, transitions)), counters.transitions);
  const std::size_t newest =
      (counters.transitions + RAVENCAL_TRANSITIONS_KEPT - 1) % RAVENCAL_TRANSITIONS_KEPT;
  store_record(
      &at(offsetof(ravencal_counters, last_transitions) + newest * sizeof(ravencal_transition)),
      counters.last_transitions[newest]);
}

}  // namespace ravencal::rt
