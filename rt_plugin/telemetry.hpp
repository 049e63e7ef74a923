// SPDX-License-Identifier: Apache-2.0
//
// Writes every tick and the counters to a ring in shared memory (ravencal/telemetry.h says how it
// is laid out and read). One writer; it never waits, and never reads what it wrote, so no reader
// can slow it down or change what it does.
#pragma once

#include <cstdint>

#include "ravencal/plugin.h"
#include "ravencal/telemetry.h"
#include "rt_plugin/joint_vector.hpp"
#include "rt_plugin/named_memory.hpp"

namespace ravencal::rt {

class Telemetry {
 public:
  Telemetry() = default;
  ~Telemetry() { close(); }
  Telemetry(const Telemetry&) = delete;
  Telemetry& operator=(const Telemetry&) = delete;

  /// [init] Creates the shared memory `config.telemetry_name` (named_memory.hpp); does nothing if
  /// the name is empty. What a dead process left under that name is replaced. RAVENCAL_SUCCESS;
  /// _ERROR_ARGUMENT: not a name; _ERROR_BUSY: a live process writes it, or it is something else,
  /// unless another user than root has it: then there is no telemetry, and no error;
  /// _ERROR_MEMORY: no room; _ERROR_LIMIT: a limit of the process; _ERROR_IO: the system refuses.
  std::int32_t open(const ravencal_config& config) noexcept;

  /// [rt] One tick and the counters after it. Does the same work whatever they hold.
  /// `offset_ji`: correction minus the wanted one. `request_taken`: number of the request.
  void write(const ravencal_tick& tick, const JointVector& offset_ji,
             const ravencal_counters& counters, std::uint64_t request_taken,
             const ravencal_telemetry_homing& homing) noexcept;

  /// [rt] Where programs of the same user ask for something (requests.hpp); null without memory.
  [[nodiscard]] const std::uint64_t* requests() const noexcept { return memory_.requests(); }
  /// Nanoseconds since 1970 at open().
  [[nodiscard]] std::int64_t start_realtime_ns() const noexcept { return start_realtime_ns_; }

 private:
  void close() noexcept;

  NamedMemory memory_;
  std::uint64_t written_ = 0;  ///< ticks
  std::int64_t start_realtime_ns_ = 0;
};

}  // namespace ravencal::rt
