// SPDX-License-Identifier: Apache-2.0
//
// What the plugin did, or in SHADOW would have done, in a recording of `ravencal monitor --record`.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "ravencal/plugin.h"
#include "record/recording.hpp"

namespace ravencal::shadow {

/// Of one joint: rad, or m of the insertion.
struct JointOperation {
  double largest_ji = 0.0;        ///< correction, would-be in SHADOW
  double press_change_ji = 0.0;   ///< largest change of it in the first cycle of a press
  double follow_change_ji = 0.0;  ///< largest change of it in one cycle with the pedal down
  double offset_ji = 0.0;         ///< largest; see ABI.md, "What moves the motors"
  double lowest_ji = 0.0;         ///< of the raw joint
  double highest_ji = 0.0;
};

struct Operation {
  std::uint64_t ticks = 0;
  std::uint64_t lost_ticks = 0;  ///< that the monitor was too slow for
  double tick_s = 0.0;
  std::uint64_t shadow_ticks = 0;
  std::uint64_t pedal_down_ticks = 0;
  std::uint64_t corrected_ticks = 0;  ///< of those with the pedal down, also what would be
  std::uint64_t presses = 0;
  /// By the state that the plugin was in, or would have been in.
  std::array<std::uint64_t, RAVENCAL_STATE_COUNT> ticks_in_state{};
  std::array<std::uint64_t, RAVENCAL_DOUBT_KINDS> ticks_in_doubt{};
  double longest_step_s = 0.0;
  std::uint64_t long_steps = 0;  ///< longer than half a tick
  std::array<JointOperation, RAVENCAL_JOINTS> joints;
};

/// Whether `monitor --record` made it.
bool is_of_monitor(const record::Recording& recording);

/// Errors (kData): a channel is missing, or there is no row.
core::Result<Operation> operation_in(const record::Recording& recording);

/// What speaks against arming, a sentence each: a fault, a press that is doubted or that changed
/// the correction, steps that were too long.
std::vector<std::string> findings(const Operation& operation);

/// The page, for a terminal; and the same as JSON, in SI units.
std::string operation_text(const Operation& operation);
std::string operation_json(const Operation& operation);

}  // namespace ravencal::shadow
