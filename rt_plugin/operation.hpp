// SPDX-License-Identifier: Apache-2.0
//
// What the operator asked for: the mode, how much of the correction is applied, and of which
// joints. Asked from any thread, in force at the start of a cycle.
#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "ravencal/plugin.h"

namespace ravencal::rt {

class Operation {
 public:
  explicit Operation(const ravencal_config& config) noexcept
      : resumes_(config.resume_after_stop != 0),
        asked_share_(packed(config.share, config.joint_mask)),
        share_(asked_share_.load(std::memory_order_relaxed)) {}

  /// [any] RAVENCAL_MODE_*.
  void set_mode(std::int32_t mode) noexcept { asked_mode_.store(mode, std::memory_order_relaxed); }
  /// [any] `share`: 0..1; `joints`: bit j for joint j. In force once the motors do not follow.
  void set_share(float share, std::uint32_t joints) noexcept {
    asked_share_.store(packed(share, joints), std::memory_order_relaxed);
  }
  /// [any] Off, and out of FAULT.
  void reset() noexcept {
    set_mode(RAVENCAL_MODE_OFF);
    asked_reset_.store(1, std::memory_order_relaxed);
  }

  /// [rt] Start of a cycle. `has_stopped`: the robot ran in the cycle before and does not in this
  /// one; unless the settings say otherwise, what was armed is then only shown. Returns whether
  /// another share is in force.
  bool advance(bool motors_follow, bool has_stopped) noexcept {
    if (has_stopped && !resumes_) {
      std::int32_t armed = RAVENCAL_MODE_ARM;
      asked_mode_.compare_exchange_strong(armed, RAVENCAL_MODE_SHADOW, std::memory_order_relaxed);
    }
    mode_ = asked_mode_.load(std::memory_order_relaxed);
    resets_ = asked_reset_.load(std::memory_order_relaxed) != 0;
    if (resets_) asked_reset_.store(0, std::memory_order_relaxed);
    const std::uint64_t before = share_;
    if (!motors_follow) share_ = asked_share_.load(std::memory_order_relaxed);
    return share_ != before;
  }

  /// [rt] Of this cycle.
  [[nodiscard]] std::int32_t mode() const noexcept { return mode_; }
  [[nodiscard]] bool resets() const noexcept { return resets_; }
  /// 0..1; 0 for a joint that is not to be corrected.
  [[nodiscard]] float share_of(std::size_t joint) const noexcept {
    const auto share = std::bit_cast<float>(static_cast<std::uint32_t>(share_));
    return ((share_ >> (32 + joint)) & 1U) != 0 ? share : 0.0F;
  }

 private:
  static std::uint64_t packed(float share, std::uint32_t joints) noexcept {
    return std::uint64_t{joints} << 32 | std::bit_cast<std::uint32_t>(share);
  }

  const bool resumes_;  ///< after an emergency stop, in the mode of before

  // Written by any thread.
  std::atomic<std::int32_t> asked_mode_{RAVENCAL_MODE_OFF};
  std::atomic<std::int32_t> asked_reset_{0};
  std::atomic<std::uint64_t> asked_share_;

  // Real-time thread only: in force.
  std::int32_t mode_ = RAVENCAL_MODE_OFF;
  bool resets_ = false;
  std::uint64_t share_;
};

}  // namespace ravencal::rt
