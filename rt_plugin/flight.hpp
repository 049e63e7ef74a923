// SPDX-License-Identifier: Apache-2.0
//
// The last ticks before a FAULT. Two buffers: the real-time thread writes one in a ring, and at a
// FAULT leaves it as it is and goes on in the other. Nothing is copied, so the tick of a FAULT
// takes no more time than any other, and a record stays until the next FAULT.
#pragma once

#include <array>
#include <cstdint>

#include "ravencal/plugin.h"
#include "rt_plugin/telemetry_words.hpp"

namespace ravencal::rt {

class FlightRecorder {
 public:
  /// [rt] Keeps one tick. The first one with `faulted` after others without ends the record.
  void record(const ravencal_tick& tick, bool faulted) noexcept;

  /// [any] Copies the record of the last FAULT into `flight`, all but struct_size; false if there
  /// was none. Entries: up to RAVENCAL_FLIGHT_TICKS; fewer if the plugin was created, or the FAULT
  /// before came, less than so many ticks earlier.
  bool copy(ravencal_flight& flight) const noexcept;

 private:
  struct Buffer {
    std::array<Words<ravencal_tick>, RAVENCAL_FLIGHT_TICKS> ticks{};
    std::uint64_t count = 0;  ///< valid ticks; set when the record ends
    std::uint64_t next = 0;   ///< index after the newest; set when the record ends
  };

  // FAULT number n (the first is 1) is kept in buffer n % 2. Its record is stable while faults_ is
  // n: the real-time thread touches it again only after it has stored n + 1.
  std::array<Buffer, 2> buffers_;
  std::uint64_t faults_ = 0;

  // Real-time thread only: of the buffer being written.
  std::uint64_t count_ = 0;
  std::uint64_t next_ = 0;
  bool faulted_ = false;
};

}  // namespace ravencal::rt
