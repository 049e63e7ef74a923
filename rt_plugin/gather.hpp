// SPDX-License-Identifier: Apache-2.0
//
// From ravencal_state to the channels that training saw, as SI floats. At the hook the positions
// are those of this cycle, but torque, desired values and pose are one cycle old and the DAC
// commands already cleared; those are read from the state that was latched where the controller
// published it (the controller's order: clearDACs -> hook -> control law -> publish).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "ravencal/plugin.h"

namespace ravencal::rt {

/// How to read channels that lie side by side in a ravencal_state.
struct ChannelReader {
  enum class Kind : std::uint8_t { kFloat, kInt32, kTime };
  Kind kind = Kind::kFloat;
  bool latched = false;      ///< read from the last published state
  std::uint16_t offset = 0;  ///< bytes into ravencal_state, of the first
  std::uint32_t count = 1;
  double to_si = 1.0;

  /// Whether `next` reads what lies behind, in the same way.
  [[nodiscard]] bool goes_on_with(const ChannelReader& next) const noexcept {
    return kind != Kind::kTime && kind == next.kind && latched == next.latched &&
           to_si == next.to_si && offset + count * sizeof(float) == next.offset;
  }
};

/// Reader of the channel with that catalogue index (core/catalogue.hpp, below kCatalogueSize).
ChannelReader reader_of(std::size_t catalogue_index) noexcept;

/// True for channels that say where the robot is, rather than how it moves or is driven: leaving
/// their trained range means leaving the trained workspace.
bool is_position(std::size_t catalogue_index) noexcept;

/// The channels of the readers, one after another; `time_s` is the value of the time channel.
void gather(std::span<const ChannelReader> readers, const ravencal_state& current,
            const ravencal_state& latched, float time_s, float* values) noexcept;

}  // namespace ravencal::rt
