// SPDX-License-Identifier: Apache-2.0
//
// The constant error of one homing, told by a known pose, beside what the weights predict. It is
// taken with the pedal up, belongs to the weights and the homing for which it was computed, and
// ends with either. A homing is known by the encoder offsets that it found.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/run_level.hpp"
#include "ravencal/control.h"
#include "ravencal/plugin.h"
#include "rt_plugin/guards.hpp"
#include "rt_plugin/joint_vector.hpp"
#include "rt_plugin/telemetry_words.hpp"

namespace ravencal::rt {

class HomingConstant {
 public:
  /// [init] One at a time; all zeros take away what is in force.
  void offer(const ravencal_homing_constant& constant) noexcept {
    store_word(sequence_, sequence_ + 1);  // odd: being written
    store_record(offered_.data(), constant);
    store_word(sequence_, sequence_ + 1);
  }

  /// [rt] The same, from a request.
  void ask(const ravencal_homing_constant& constant) noexcept {
    asked_ = constant;
    waits_ = true;
  }

  /// [rt] Start of a cycle, after other weights came into use. `weights_checksum`: 0 without any;
  /// `largest_ji`: no constant exceeds it. Returns whether another constant is in force.
  bool advance(const ravencal_state& state, std::uint32_t weights_checksum,
               const JointVector& largest_ji) noexcept {
    look();
    const bool is_init = state.runlevel == core::kInit;
    const bool stays = !is_init && belongs(in_force_, state.arm[0], weights_checksum);
    const JointVector before_ji = ji();
    if (!stays) in_force_ = {};
    if (is_init) waits_ = false;
    if (waits_ && state.runlevel == core::kPedalUp) {
      waits_ = false;
      const bool begins =
          belongs(asked_, state.arm[0], weights_checksum) && is_within(asked_, largest_ji);
      if (begins) {
        in_force_ = asked_;
      } else if (asked_.weights_checksum == 0) {
        in_force_ = {};
      }
    }
    return ji() != before_ji;
  }

  /// [rt] In force; zeros without one.
  [[nodiscard]] JointVector ji() const noexcept {
    return {in_force_.constant_ji[0], in_force_.constant_ji[1], in_force_.constant_ji[2]};
  }
  [[nodiscard]] const ravencal_homing_constant& in_force() const noexcept { return in_force_; }

  /// [any] Whether each joint's is a number of at most `largest_ji`.
  [[nodiscard]] static bool is_within(const ravencal_homing_constant& constant,
                                      const JointVector& largest_ji) noexcept {
    bool is_within = true;
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      is_within = is_within && std::fabs(constant.constant_ji[j]) <= largest_ji[j];
    }
    return is_within;
  }

 private:
  [[nodiscard]] static bool belongs(const ravencal_homing_constant& constant,
                                    const ravencal_arm& arm,
                                    std::uint32_t weights_checksum) noexcept {
    return weights_checksum != 0 && constant.weights_checksum == weights_checksum &&
           StateGuards::is_homed(arm) &&
           std::equal(constant.enc_offset_counts, constant.enc_offset_counts + RAVENCAL_JOINTS,
                      arm.enc_offset_counts);
  }

  /// One look at what is offered, without waiting: half of it is none, and is whole in a later
  /// cycle.
  void look() noexcept {
    const std::uint64_t before = load_word(sequence_);
    if (before == seen_ || before % 2 != 0) return;
    const auto offered = load_record<ravencal_homing_constant>(offered_.data());
    if (load_word(sequence_) != before) return;
    seen_ = before;
    ask(offered);
  }

  // Written by the loading thread.
  std::uint64_t sequence_ = 0;
  Words<ravencal_homing_constant> offered_{};

  // Real-time thread only.
  std::uint64_t seen_ = 0;
  bool waits_ = false;
  ravencal_homing_constant asked_{};
  ravencal_homing_constant in_force_{};
};

}  // namespace ravencal::rt
