// SPDX-License-Identifier: Apache-2.0
//
// The loop of a robot's control process, as far as the plugin sees it: wakes on absolute deadlines,
// hands the state over at the hook and at the end of the cycle, and stores what came back.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host/robot_source.hpp"
#include "plugin_host/plugin_library.hpp"

namespace ravencal::host {

struct LoopOptions {
  double rate_hz = 1000.0;  ///< wake-ups per second; 0: no waiting, as fast as the machine goes
  std::int64_t ticks = 0;
};

/// One cycle as it was.
struct Tick {
  std::uint32_t step_ns = 0;    ///< the plugin's step alone
  std::uint32_t wakeup_ns = 0;  ///< from deadline to running; 0 if the loop does not wait
  std::uint32_t cycle_ns = 0;   ///< everything from waking to the end, the stand-in robot included
  std::int32_t state = 0;       ///< RAVENCAL_STATE_*
  std::array<float, RAVENCAL_JOINTS> raw_ji{};
  std::array<float, RAVENCAL_JOINTS> corrected_ji{};
  std::array<double, RAVENCAL_JOINTS> truth_ji{};
};

struct LoopResult {
  std::vector<Tick> ticks;
  std::uint64_t overruns = 0;  ///< cycles that were not done at the next deadline
  bool real_time = false;      ///< ran at SCHED_FIFO
  bool memory_locked = false;
  std::string hindrance;  ///< why not in real time; empty if it was
};

/// Runs the loop in a thread of its own, at SCHED_FIFO where the system permits it, until `ticks`
/// are done, `source` ends or `keep_going` says no. `keep_going` is called with the share done, ten
/// times a second, from the calling thread.
LoopResult run_loop(const LoopOptions& options, plugin_host::Instance& plugin, RobotSource& source,
                    const std::function<bool(double)>& keep_going);

}  // namespace ravencal::host
