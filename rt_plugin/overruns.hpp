// SPDX-License-Identifier: Apache-2.0
//
// Whether the plugin keeps to its own time budget. An interrupt or a firmware trap makes a single
// step too long; such steps are tolerated. Too many of them within a second mean that the network
// is too large for the robot's loop; they end the correction until reset. Real-time thread only.
#pragma once

#include <array>
#include <cstdint>

#include "ravencal/plugin.h"

namespace ravencal::rt {

class OverrunWatch {
 public:
  static constexpr std::uint64_t kWindowTicks = 1000;
  static constexpr std::uint32_t kMostOverruns = 64;  ///< of config.max_overruns

  explicit OverrunWatch(const ravencal_config& config) noexcept
      : budget_ns_(config.step_budget_ns), allowed_(config.max_overruns) {}

  /// Takes the length of step number `tick` (rising); returns whether it was an overrun.
  bool count(std::uint64_t tick, std::uint32_t step_ns) noexcept {
    if (budget_ns_ == 0 || step_ns <= budget_ns_) return false;
    ticks_[next_] = tick;
    next_ = next_ + 1 == allowed_ ? 0 : next_ + 1;
    ++seen_;
    // The ring holds the last `allowed_` overruns, so its next slot is the oldest of them.
    exhausted_ = exhausted_ || (seen_ >= allowed_ && tick - ticks_[next_] < kWindowTicks);
    return true;
  }

  [[nodiscard]] bool exhausted() const noexcept { return exhausted_; }

  void reset() noexcept {
    exhausted_ = false;
    seen_ = 0;
  }

 private:
  std::uint32_t budget_ns_;
  std::uint32_t allowed_;
  std::array<std::uint64_t, kMostOverruns> ticks_{};  ///< of the last overruns
  std::uint32_t next_ = 0;
  std::uint64_t seen_ = 0;
  bool exhausted_ = false;
};

}  // namespace ravencal::rt
