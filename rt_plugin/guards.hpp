// SPDX-License-Identifier: Apache-2.0
//
// What the robot's state says against correcting it, alone and compared with the cycle before:
// run level, pedal, clock, encoders. The model's own doubts (ranges, distance, finite numbers) are
// LoadedModel's. Real-time thread only.
#pragma once

#include <array>
#include <cstdint>

#include "core/run_level.hpp"
#include "ravencal/plugin.h"
#include "rt_plugin/joint_vector.hpp"

namespace ravencal::rt {

class StateGuards {
 public:
  /// The clock may be late by scheduling, but a gap of so many ticks is a jump.
  static constexpr std::uint64_t kLongestGapTicks = 10;
  /// For so long after the pedal moved, the correction is held: the CRTK branch goes on with the
  /// desired joints of before for ten cycles after the last joint command.
  static constexpr std::uint32_t kPedalNs = 20'000'000;

  explicit StateGuards(const ravencal_config& config) noexcept;

  /// Whether the motors follow the desired joints, and with them the correction: the pedal is down.
  /// Otherwise the brakes hold, and the desired joints are set to the measured ones each cycle.
  [[nodiscard]] static bool motors_follow(const ravencal_state& state) noexcept {
    return state.runlevel == core::kPedalDown;
  }

  /// Whether joints 1 to 3 are ready.
  [[nodiscard]] static bool is_homed(const ravencal_arm& arm) noexcept {
    constexpr std::uint32_t kReady = (1U << RAVENCAL_JOINTS) - 1U;
    return (arm.joints_ready & kReady) == kReady;
  }

  /// RAVENCAL_DOUBT_* of this cycle; remembers it as the one before the next.
  std::uint32_t inspect(const ravencal_state& state) noexcept;

  /// RAVENCAL_DOUBT_MAGNITUDE if a prediction exceeds what may be corrected.
  [[nodiscard]] static std::uint32_t inspect_magnitude(const JointVector& predicted_ji,
                                                       const JointVector& largest_ji) noexcept;

  /// The robot ran, with the pedal up or down, in the cycle before the inspected one, and does not
  /// in this one.
  [[nodiscard]] bool has_stopped() const noexcept { return has_stopped_; }

  /// Time that the robot's clock passed since the cycle before the inspected one, but at most a
  /// tick; 0 where the clock stood still or ran back. Before the first cycle the clock was 0.
  [[nodiscard]] std::uint32_t passed_ns() const noexcept { return passed_ns_; }

  /// Whether a state published at `t_ns` is that of the cycle before the inspected one.
  [[nodiscard]] bool is_previous(std::int64_t t_ns) const noexcept {
    return cycles_ > 1 && t_ns == previous_ns_;
  }

 private:
  [[nodiscard]] static bool is_running(std::int32_t runlevel) noexcept {
    return runlevel == core::kPedalUp || runlevel == core::kPedalDown;
  }
  [[nodiscard]] std::uint32_t inspect_robot(const ravencal_state& state) const noexcept;
  std::uint32_t inspect_pedal(const ravencal_state& state) noexcept;
  std::uint32_t inspect_clock(std::int64_t t_ns) noexcept;
  std::uint32_t inspect_encoders(const ravencal_arm& arm) noexcept;

  std::uint32_t tick_ns_;
  std::uint64_t max_encoder_step_;  ///< counts per tick
  std::uint64_t cycles_ = 0;        ///< inspected
  std::int64_t last_ns_ = 0;        ///< of the inspected cycle
  std::int64_t previous_ns_ = 0;    ///< of the one before
  std::uint64_t elapsed_ticks_ = 1;
  std::uint32_t passed_ns_ = 0;
  std::int32_t runlevel_ = 0;
  bool has_stopped_ = false;
  std::uint32_t pedal_left_ns_ = 0;
  std::array<std::int32_t, RAVENCAL_JOINTS> counts_{};
};

}  // namespace ravencal::rt
