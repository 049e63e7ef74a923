// SPDX-License-Identifier: Apache-2.0
#include "host/summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/joint_layout.hpp"

namespace ravencal::host {
namespace {

Percentiles percentiles(const std::vector<Tick>& ticks, std::uint32_t Tick::*member) {
  if (ticks.empty()) return {};
  std::vector<std::uint32_t> values;
  values.reserve(ticks.size());
  for (const Tick& tick : ticks) values.push_back(tick.*member);
  std::sort(values.begin(), values.end());
  // Nearest rank: the smallest value that at least this share of all values does not exceed.
  const auto at = [&](double share) {
    const double rank = std::ceil(share * static_cast<double>(values.size()));
    return values[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
  };
  return {at(0.5), at(0.99), at(0.999), values.back()};
}

bool is_corrected(const Tick& tick) {
  return tick.state == RAVENCAL_STATE_FADING_IN || tick.state == RAVENCAL_STATE_ACTIVE;
}

learn::JointEvaluation evaluate_joint(const std::vector<Tick>& ticks,
                                      const model::OutputSpec& output, double bias) {
  const auto slot = static_cast<std::size_t>(
      std::find(core::kSlotNames.begin(), core::kSlotNames.end(), output.joint) -
      core::kSlotNames.begin());
  learn::JointEvaluation joint;
  joint.joint = output.joint;
  joint.unit = output.unit;
  joint.bias = bias;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const Tick& tick = ticks[i];
    if (!is_corrected(tick) || !std::isfinite(tick.truth_ji[slot])) continue;
    joint.t_s.push_back(static_cast<double>(i) * 1e-3);
    joint.truth.push_back(tick.truth_ji[slot]);
    joint.estimate.push_back(static_cast<double>(tick.raw_ji[slot]));
    joint.corrected.push_back(static_cast<double>(tick.corrected_ji[slot]));
  }
  learn::set_figures(joint);
  return joint;
}

std::string microseconds(const Percentiles& p) {
  return fmt::format("{:>9.1f}{:>9.1f}{:>9.1f}{:>9.1f}", p.p50 / 1e3, p.p99 / 1e3, p.p999 / 1e3,
                     p.max / 1e3);
}

nlohmann::ordered_json json_of(const Percentiles& p) {
  return {{"p50", p.p50}, {"p99", p.p99}, {"p999", p.p999}, {"max", p.max}};
}

}  // namespace

Summary summarise(const LoopResult& result, const LoopOptions& options,
                  const plugin_host::Instance& plugin, const model::CalibrationModel& model) {
  Summary summary;
  summary.ticks = result.ticks.size();
  summary.corrected_ticks = static_cast<std::size_t>(
      std::count_if(result.ticks.begin(), result.ticks.end(), is_corrected));
  for (std::size_t k = 0; k < model.outputs.size(); ++k) {
    summary.evaluation.joints.push_back(evaluate_joint(
        result.ticks, model.outputs[k], model.output.mean[static_cast<Eigen::Index>(k)]));
  }
  summary.evaluation.rows = summary.ticks;
  summary.rate_hz = options.rate_hz;
  summary.real_time = result.real_time && result.memory_locked;
  summary.hindrance = result.hindrance;
  summary.overruns = result.overruns;
  summary.step_ns = percentiles(result.ticks, &Tick::step_ns);
  summary.wakeup_ns = percentiles(result.ticks, &Tick::wakeup_ns);
  summary.cycle_ns = percentiles(result.ticks, &Tick::cycle_ns);
  summary.counters = plugin.counters();
  summary.info = plugin.info();
  return summary;
}

std::string limits_text(const Summary& summary) {
  if (summary.counters.limited_rate == 0) return "";
  return fmt::format(
      "limited     {} corrections of a joint in {} ticks followed the network late: with the pedal "
      "down a correction changes by at most a tenth of its joint's commanded motion\n",
      summary.counters.limited_rate, summary.ticks);
}

std::string summary_text(const Summary& s) {
  std::string text;
  text += fmt::format(
      "network     {} inputs, {} parameters in {}, {} code, {:.0f} KiB per step\n", s.info.inputs,
      s.info.parameters, plugin_host::precision_name(s.info.precision),
      plugin_host::isa_name(s.info.isa), static_cast<double>(s.info.bytes_per_step) / 1024.0);
  text += s.real_time ? "real time   SCHED_FIFO, memory locked\n"
                      : fmt::format("real time   no: {}\n", s.hindrance);
  text += fmt::format("loop        {} ticks at {}, {} overruns; corrected in {} of them\n", s.ticks,
                      s.rate_hz > 0.0 ? fmt::format("{:g} Hz", s.rate_hz) : "full speed",
                      s.overruns, s.corrected_ticks);
  text += fmt::format("{:<12}{:>9}{:>9}{:>9}{:>9}\n", "us", "p50", "p99", "p99.9", "max");
  text += "step        " + microseconds(s.step_ns) + "\n";
  if (s.rate_hz > 0.0) text += "wake-up     " + microseconds(s.wakeup_ns) + "\n";
  text += "whole cycle " + microseconds(s.cycle_ns) + "\n";
  text += "states     ";
  for (std::int32_t state = 0; state < RAVENCAL_STATE_COUNT; ++state) {
    if (s.counters.ticks_in_state[state] == 0) continue;
    text += fmt::format(" {} {}", plugin_host::state_name(state), s.counters.ticks_in_state[state]);
  }
  text += "\n";
  for (std::size_t kind = 0; kind < RAVENCAL_DOUBT_KINDS; ++kind) {
    if (s.counters.ticks_in_doubt[kind] == 0) continue;
    text += fmt::format("doubt       {} in {} ticks\n", plugin_host::doubt_name(kind),
                        s.counters.ticks_in_doubt[kind]);
  }
  text += limits_text(s);
  if (s.faults > 0) {
    text += fmt::format("FAULT       {}; the last ticks before the last one are in {}\n", s.faults,
                        s.flight_path);
  }
  if (s.corrected_ticks > 0)
    text += "\nas the plugin applied it:\n" + learn::evaluation_table(s.evaluation);
  return text;
}

std::string summary_json(const Summary& s) {
  // The joints are exactly those of `evaluate`.
  auto json = nlohmann::ordered_json::parse(learn::evaluation_json(s.evaluation));
  json["ticks"] = s.ticks;
  json["rate_hz"] = s.rate_hz;
  json["realtime"] = s.real_time;
  json["step_ns"] = json_of(s.step_ns);
  json["wakeup_ns"] = json_of(s.wakeup_ns);
  json["cycle_ns"] = json_of(s.cycle_ns);
  json["overruns"] = s.overruns;
  auto& states = json["states"];
  for (std::int32_t state = 0; state < RAVENCAL_STATE_COUNT; ++state) {
    states[plugin_host::state_name(state)] = s.counters.ticks_in_state[state];
  }
  states["transitions"] = s.counters.transitions;
  for (std::size_t kind = 0; kind < RAVENCAL_DOUBT_KINDS; ++kind) {
    states["doubts"][plugin_host::doubt_name(kind)] = s.counters.ticks_in_doubt[kind];
  }
  states["clamped_inputs"] = s.counters.clamped_inputs;
  states["limited_rate"] = s.counters.limited_rate;
  states["swaps"] = s.counters.swaps;
  json["faults"] = s.faults;
  if (s.faults > 0) json["flight_record"] = s.flight_path;
  json["plugin"] = {{"instruction_set", plugin_host::isa_name(s.info.isa)},
                    {"precision", plugin_host::precision_name(s.info.precision)},
                    {"inputs", s.info.inputs},
                    {"parameters", s.info.parameters},
                    {"bytes_per_step", s.info.bytes_per_step},
                    {"memory_locked", s.info.memory_locked != 0}};
  return json.dump(2) + "\n";
}

}  // namespace ravencal::host
