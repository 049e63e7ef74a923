// SPDX-License-Identifier: Apache-2.0
#include "monitor/view.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>

#include "plugin_host/plugin_library.hpp"

namespace ravencal::monitor {
namespace {

constexpr std::size_t kColumns = 80;
constexpr std::uint64_t kTransitionsShown = 5;

const char* run_level_in_words(std::int32_t run_level) {
  constexpr const char* kNames[] = {"E-stop", "init", "pedal up", "pedal down"};
  return run_level >= 0 && run_level < 4 ? kNames[run_level] : "unknown";
}

std::string joined(const std::vector<std::string>& words) {
  return words.empty() ? "none" : fmt::format("{}", fmt::join(words, " "));
}

/// Of the homing; empty where none is in force.
std::string constant_text(const ravencal_homing_constant& constant) {
  if (constant.weights_checksum == 0) return "";
  std::string text = "homing      constant";
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    const JointUnits& units = units_of(j);
    text +=
        fmt::format("  {} {:+.3f} {}", units.joint,
                    static_cast<double>(constant.constant_ji[j]) * units.shown_per_si, units.shown);
  }
  return text;
}

std::string joint_line(const NumberedTick& numbered, std::size_t j, const History& history,
                       bool ascii) {
  const ravencal_tick& tick = numbered.tick;
  const JointUnits& units = units_of(j);
  const auto shown = [&](float value) { return static_cast<double>(value) * units.shown_per_si; };
  return fmt::format("{:<9}{:>9.3f}{:>9.3f} {:<3}{:>+8.3f}{:>+8.3f}{:>+8.3f}  {}", units.joint,
                     shown(tick.jpos_ji[j]), shown(tick.jpos_ji[j] + numbered.applied_ji(j)),
                     units.shown, shown(tick.correction_ji[j]), shown(tick.predicted_ji[j]),
                     shown(numbered.offset_ji[j]), history.sparkline(ascii));
}

void add_tick(std::vector<std::string>& lines, const Watch& watch, bool ascii) {
  const ravencal_tick& tick = watch.newest()->tick;
  lines.push_back(fmt::format("state       {:<12}  run level {} ({})  confidence {:.2f}",
                              watch.state(), tick.runlevel, run_level_in_words(tick.runlevel),
                              static_cast<double>(tick.confidence)));
  lines.push_back("doubts now  " + joined(doubts_in_words(tick.doubts)));
  lines.push_back(constant_text(watch.homing_constant()));
  const bool is_shadow = tick.state == RAVENCAL_STATE_SHADOW;
  lines.push_back(fmt::format("{:<9}{:>9}{:>9} {:<3}{:>8}{:>8}{:>8}  {}", "joint", "raw",
                              "published", "", is_shadow ? "would be" : "correct.", "network",
                              "offset", "correct., last 10 s"));
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    lines.push_back(joint_line(*watch.newest(), j, watch.correction(j), ascii));
  }
  lines.push_back(fmt::format("encoders  {:>9} {:>9} {:>9} counts", tick.enc_counts[0],
                              tick.enc_counts[1], tick.enc_counts[2]));
  lines.push_back(fmt::format("step      {:>9.1f} us  highest {:>7.1f}  ever {:>8.1f} {}",
                              tick.step_ns / 1e3, watch.step_us().highest(),
                              static_cast<double>(watch.counters().longest_step_ns) / 1e3,
                              watch.step_us().sparkline(ascii)));
}

void add_counters(std::vector<std::string>& lines, const ravencal_counters& counters) {
  lines.push_back(fmt::format("ticks {}   swaps {}   rollbacks {}   overruns {}", counters.ticks,
                              counters.swaps, counters.rollbacks, counters.overruns));
  lines.push_back(fmt::format("clamped inputs {}   rate limited {}   transitions {}",
                              counters.clamped_inputs, counters.limited_rate,
                              counters.transitions));
  std::string states = "in state    ";
  for (std::int32_t state = 0; state < RAVENCAL_STATE_COUNT; ++state) {
    if (counters.ticks_in_state[state] == 0) continue;
    states +=
        fmt::format("{} {}  ", plugin_host::state_name(state), counters.ticks_in_state[state]);
  }
  lines.push_back(states);
  std::string doubts = "in doubt    ";
  for (std::size_t kind = 0; kind < RAVENCAL_DOUBT_KINDS; ++kind) {
    if (counters.ticks_in_doubt[kind] == 0) continue;
    doubts += fmt::format("{} {}  ", plugin_host::doubt_name(kind), counters.ticks_in_doubt[kind]);
  }
  lines.push_back(doubts);
}

void add_transitions(std::vector<std::string>& lines, const ravencal_counters& counters) {
  lines.emplace_back("last changes of state");
  for (std::uint64_t back = 1; back <= kTransitionsShown && back <= counters.transitions; ++back) {
    const ravencal_transition& change =
        counters.last_transitions[(counters.transitions - back) % RAVENCAL_TRANSITIONS_KEPT];
    lines.push_back(fmt::format("  tick {:>10}  {} -> {}  {}", change.tick,
                                plugin_host::state_name(change.from),
                                plugin_host::state_name(change.to),
                                change.doubts == 0 ? "" : joined(doubts_in_words(change.doubts))));
  }
}

}  // namespace

std::string clip(const std::string& text, std::size_t columns) {
  std::size_t used = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool begins = (static_cast<unsigned char>(text[i]) & 0xC0U) != 0x80U;
    if (begins && used++ == columns) return text.substr(0, i);
  }
  return text;
}

std::vector<std::string> draw(const Watch& watch, const TelemetryReader& reader,
                              const Surroundings& surroundings) {
  std::vector<std::string> lines;
  const auto started = static_cast<std::time_t>(reader.start_realtime_ns() / 1'000'000'000);
  lines.push_back(fmt::format("{}   process {} since {:%H:%M:%S}, plugin {}", surroundings.name,
                              reader.writer_pid(), fmt::localtime(started),
                              reader.plugin_version()));
  lines.push_back(surroundings.notice);
  if (watch.newest()) {
    add_tick(lines, watch, surroundings.ascii);
    lines.emplace_back();
    add_counters(lines, watch.counters());
    add_transitions(lines, watch.counters());
  }
  lines.push_back(fmt::format("newest tick {:.1f} s old, seen {}, missed {}{}   Ctrl-C ends",
                              watch.age_s(), watch.taken(), watch.missed(),
                              surroundings.recording.empty() ? "" : "; " + surroundings.recording));
  for (std::string& line : lines) line = clip(line, kColumns);
  return lines;
}

std::string draw_line(const Watch& watch, const Surroundings& surroundings) {
  if (!surroundings.notice.empty()) return surroundings.notice;
  if (!watch.newest()) return "no tick yet";
  const ravencal_tick& tick = watch.newest()->tick;
  std::string line = fmt::format("tick {} {}", watch.newest()->number, watch.state());
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    const JointUnits& units = units_of(j);
    line += fmt::format("  {} {:.3f}{:+.3f} {}", units.joint,
                        static_cast<double>(tick.jpos_ji[j]) * units.shown_per_si,
                        static_cast<double>(watch.newest()->applied_ji(j)) * units.shown_per_si,
                        units.shown);
  }
  line += fmt::format("  step {:.1f} us  doubts {}", tick.step_ns / 1e3,
                      joined(doubts_in_words(tick.doubts)));
  const std::string constant = constant_text(watch.homing_constant());
  return constant.empty() ? line : line + "  " + constant;
}

}  // namespace ravencal::monitor
