// SPDX-License-Identifier: Apache-2.0
//
// Present state of the plugin: the newest tick, the counters, the ticks that this reader missed,
// and the last ten seconds in steps of 0.5 s.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "monitor/telemetry_follower.hpp"

namespace ravencal::monitor {

/// The last ten seconds of one value: of each step the lowest and the highest.
class History {
 public:
  static constexpr std::size_t kSteps = 20;
  static constexpr std::uint64_t kStepNs = 500'000'000;

  /// `step`: number of the step to which the value belongs; never less than before.
  void add(std::uint64_t step, double value);
  void clear() { steps_.clear(); }

  /// kSteps characters from blank to full, the newest last; scaled to the range shown.
  /// `ascii`: without the block characters of Unicode.
  [[nodiscard]] std::string sparkline(bool ascii) const;
  /// Highest value shown; 0 if there is none.
  [[nodiscard]] double highest() const;

 private:
  struct Step {
    std::uint64_t number;
    double lowest;
    double highest;
  };
  std::deque<Step> steps_;
};

class Watch {
 public:
  /// Ten of the longest ticks that a plugin can be set to (100 ms).
  static constexpr double kStalledAfter_s = 1.0;

  /// Ticks of the follower's writer, in order.
  void take(const NumberedTick& tick, std::uint32_t tick_ns);
  void take(const ravencal_counters& counters) { counters_ = counters; }
  void take(const ravencal_homing_constant& constant) { homing_constant_ = constant; }
  /// A new writer: its ticks count from 0.
  void begin_writer();
  /// All ticks that there were at `now_s` (any steady clock) have been taken.
  void end_poll(double now_s);

  [[nodiscard]] const std::optional<NumberedTick>& newest() const { return newest_; }
  [[nodiscard]] const ravencal_counters& counters() const { return counters_; }
  /// In force; weights_checksum 0: none.
  [[nodiscard]] const ravencal_homing_constant& homing_constant() const { return homing_constant_; }
  /// Ticks that this reader was too slow for, over all writers.
  [[nodiscard]] std::uint64_t missed() const { return missed_; }
  [[nodiscard]] std::uint64_t taken() const { return taken_; }
  /// Time since the newest tick came; at the most recent end_poll(). A writer that had stopped
  /// before this reader came is longer silent than that.
  [[nodiscard]] double age_s() const { return now_s_ - came_s_; }
  /// The control loop has stopped, whatever the newest tick says.
  [[nodiscard]] bool is_stalled() const { return age_s() > kStalledAfter_s; }
  /// False until a tick came, or could have, after the first look: what lay there may be old.
  [[nodiscard]] bool is_current() const { return fresh_ || is_stalled(); }
  /// Of the newest tick: "active" and so on; "stalled"; "shadow (would be active)".
  [[nodiscard]] std::string state() const;
  [[nodiscard]] const History& correction(std::size_t joint) const { return correction_[joint]; }
  [[nodiscard]] const History& step_us() const { return step_us_; }

 private:
  std::optional<NumberedTick> newest_;
  std::optional<std::uint64_t> expected_;
  ravencal_counters counters_{};
  ravencal_homing_constant homing_constant_{};
  std::uint64_t missed_ = 0;
  std::uint64_t taken_ = 0;
  std::uint64_t taken_before_ = 0;  ///< at the last end_poll()
  double now_s_ = 0.0;
  double came_s_ = 0.0;
  bool looked_ = false;  ///< at this writer
  bool fresh_ = false;
  std::array<History, RAVENCAL_JOINTS> correction_;
  History step_us_;
};

/// The doubts of a tick in words, in the order of their bits.
std::vector<std::string> doubts_in_words(std::uint32_t doubts);

/// "rad" or "m", and what people read: "deg" or "mm", with its factor.
struct JointUnits {
  const char* joint;
  const char* si;
  const char* shown;
  double shown_per_si;
};
const JointUnits& units_of(std::size_t joint);

}  // namespace ravencal::monitor
