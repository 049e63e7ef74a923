// SPDX-License-Identifier: Apache-2.0
//
// Follows a plugin's output from tick to tick and says in which way it ever left the envelope that
// ABI.md promises, whatever the robot, the weights and the host do.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "ravencal/plugin.h"

namespace ravencal::test {

class Witness {
 public:
  /// Whether the states that see() is given have the desired joints that the host published at the
  /// end of the same tick, in every tick: then the correction is held to the commanded motion too.
  enum class Desired { kOther, kPublished };

  explicit Witness(const ravencal_config& config, Desired desired = Desired::kOther)
      : config_(config), knows_commands_(desired == Desired::kPublished) {}

  /// Takes one tick; returns a sentence on what is
  /// wrong with it, empty if nothing is.
  std::string see(const ravencal_state& state, const ravencal_output& output);

  /// Compares the plugin's counters with what was seen: every tick since its creation.
  [[nodiscard]] std::string check(const ravencal_counters& counters) const;

 private:
  std::string see_joint(std::size_t joint, const ravencal_state& state,
                        const ravencal_output& output);

  ravencal_config config_;
  bool knows_commands_;
  /// Desired joints with the correction in them, as the plugin sees them at the end of a tick.
  struct DesiredJoints {
    std::array<double, RAVENCAL_JOINTS> ji{};
    bool pedal_down = false;
  };
  [[nodiscard]] double commanded_ji(std::size_t joint) const;

  std::array<double, RAVENCAL_JOINTS> before_{};
  std::array<DesiredJoints, 2> desired_{};  ///< of the last tick and of the one before
  std::int64_t t_ns_before_ = 0;
  std::int64_t passed_ns_ = 0;
  std::int32_t state_before_ = RAVENCAL_STATE_OFF;
  std::uint64_t ticks_ = 0;
  std::uint64_t transitions_ = 0;
  std::array<std::uint64_t, RAVENCAL_STATE_CAPACITY> ticks_in_state_{};
  std::array<std::uint64_t, RAVENCAL_DOUBT_CAPACITY> ticks_in_doubt_{};
};

}  // namespace ravencal::test
