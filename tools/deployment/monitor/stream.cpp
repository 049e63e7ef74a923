// SPDX-License-Identifier: Apache-2.0
#include "monitor/stream.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "plugin_host/plugin_library.hpp"

namespace ravencal::monitor {
namespace {

using Json = nlohmann::ordered_json;

/// JSON knows neither NaN nor infinities: null.
Json number(float value) {
  return std::isfinite(value) ? Json(static_cast<double>(value)) : Json(nullptr);
}

Json json_of(const ravencal_counters& counters) {
  Json json;
  json["ticks"] = counters.ticks;
  for (std::int32_t state = 0; state < RAVENCAL_STATE_COUNT; ++state) {
    json["states"][plugin_host::state_name(state)] = counters.ticks_in_state[state];
  }
  for (std::size_t kind = 0; kind < RAVENCAL_DOUBT_KINDS; ++kind) {
    json["doubts"][plugin_host::doubt_name(kind)] = counters.ticks_in_doubt[kind];
  }
  json["transitions"] = counters.transitions;
  json["clamped_inputs"] = counters.clamped_inputs;
  json["limited_rate"] = counters.limited_rate;
  json["swaps"] = counters.swaps;
  json["rollbacks"] = counters.rollbacks;
  json["overruns"] = counters.overruns;
  json["longest_step_ns"] = counters.longest_step_ns;
  return json;
}

}  // namespace

std::string tick_json(const Watch& watch) {
  if (!watch.newest()) return "";
  const ravencal_tick& tick = watch.newest()->tick;
  const char* const state = watch.is_stalled() ? "stalled" : plugin_host::state_name(tick.state);
  Json json = {{"number", watch.newest()->number},
               {"t_ns", tick.t_ns},
               {"age_s", watch.age_s()},
               {"state", state},
               {"last_state", plugin_host::state_name(tick.state)},
               {"would_be_state", plugin_host::state_name(tick.would_be_state)},
               {"runlevel", tick.runlevel},
               {"confidence", number(tick.confidence)},
               {"step_ns", tick.step_ns},
               {"doubts", doubts_in_words(tick.doubts)}};
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    json["joints"].push_back(
        {{"joint", units_of(j).joint},
         {"unit", units_of(j).si},
         {"raw", number(tick.jpos_ji[j])},
         {"corrected", number(tick.jpos_ji[j] + watch.newest()->applied_ji(j))},
         {"correction", number(watch.newest()->applied_ji(j))},
         {"would_be", number(tick.correction_ji[j])},
         {"offset", number(watch.newest()->offset_ji[j])},
         {"predicted", number(tick.predicted_ji[j])},
         {"homing_constant", number(watch.homing_constant().constant_ji[j])},
         {"encoder_counts", tick.enc_counts[j]}});
  }
  json["counters"] = json_of(watch.counters());
  json["missed_ticks"] = watch.missed();
  return json.dump() + "\n";
}

std::string event_json(std::string_view event, const TelemetryReader& reader) {
  const Json json = {{"event", event},
                     {"name", reader.name()},
                     {"writer_pid", reader.writer_pid()},
                     {"writer_start_ns", reader.start_realtime_ns()},
                     {"plugin_version", reader.plugin_version()},
                     {"tick_ns", reader.tick_ns()}};
  return json.dump() + "\n";
}

}  // namespace ravencal::monitor
