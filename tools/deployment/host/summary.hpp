// SPDX-License-Identifier: Apache-2.0
//
// Figures of a run of the loop, as a table and as JSON.
#pragma once

#include <string>

#include "host/loop.hpp"
#include "learn/evaluate.hpp"
#include "model/calibration_model.hpp"
#include "plugin_host/plugin_library.hpp"

namespace ravencal::host {

struct Percentiles {
  std::uint32_t p50 = 0;
  std::uint32_t p99 = 0;
  std::uint32_t p999 = 0;
  std::uint32_t max = 0;
};

struct Summary {
  learn::Evaluation evaluation;     ///< over the corrected ticks
  std::size_t corrected_ticks = 0;  ///< that follow the prediction: states FADING_IN and ACTIVE
  std::size_t ticks = 0;
  double rate_hz = 0.0;
  bool real_time = false;
  std::string hindrance;
  std::uint64_t overruns = 0;
  Percentiles step_ns;
  Percentiles wakeup_ns;
  Percentiles cycle_ns;
  ravencal_counters counters{};  ///< since the plugin was made, with the second of pedal up before
  ravencal_info info{};
  std::uint64_t faults = 0;
  std::string flight_path;  ///< the ticks before the last FAULT; empty if there was none
};

Summary summarise(const LoopResult& result, const LoopOptions& options,
                  const plugin_host::Instance& plugin, const model::CalibrationModel& model);

std::string summary_text(const Summary& summary);
/// How often the plugin's limits held a correction back; empty if never.
std::string limits_text(const Summary& summary);
std::string summary_json(const Summary& summary);

}  // namespace ravencal::host
