// SPDX-License-Identifier: Apache-2.0
//
// Reads the telemetry that a plugin writes (ravencal/telemetry.h). Attaches it read-only and needs
// nothing of the writer. A reader that falls behind loses ticks and knows which. Checks the header
// before use. Not thread-safe: one thread owns a reader.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "ravencal/telemetry.h"

namespace ravencal::monitor {

/// One tick and its number in the ring, from 0; numbers that are not there were lost.
struct NumberedTick {
  std::uint64_t number = 0;
  ravencal_tick tick{};
  std::array<float, RAVENCAL_JOINTS> offset_ji{};  ///< correction minus the wanted one

  /// What is added to the joint: nothing in SHADOW, where tick.correction_ji is what would be.
  [[nodiscard]] float applied_ji(std::size_t joint) const {
    return tick.state == RAVENCAL_STATE_SHADOW ? 0.0F : tick.correction_ji[joint];
  }
};

enum class Writer {
  kAlive,
  kEnded,  ///< in order, with a notice
  kGone,   ///< killed or crashed, without a notice
};

class TelemetryReader {
 public:
  /// `name`: as config.telemetry_name, e.g. "/ravencal-left". What root and this process's user
  /// write is trusted, and what `user` does. Errors: kUsage for what is not a name, kIo if it
  /// cannot be opened, its writer is gone or it is another user's, kData if it is not telemetry of
  /// this version.
  static core::Result<TelemetryReader> open(const std::string& name,
                                            std::optional<std::uint32_t> user = {});

  /// Appends every whole tick that has come since the last call, oldest first, at most the last two
  /// seconds. Bounded time, whatever the writer does.
  void read(std::vector<NumberedTick>& ticks);

  /// Number of the next tick that read() looks for.
  [[nodiscard]] std::uint64_t next() const { return next_; }

  /// As of one moment; nothing if the writer died in the middle of writing them.
  [[nodiscard]] std::optional<ravencal_counters> counters() const;

  /// Encoder offsets, weights and the constant of the homing, of the newest tick; zeros where the
  /// plugin is older than 3.3 or died in the middle of writing them.
  [[nodiscard]] ravencal_telemetry_homing homing() const;

  [[nodiscard]] Writer writer() const;
  /// Whether the name now leads to another segment.
  [[nodiscard]] bool is_replaced() const;

  [[nodiscard]] const std::string& name() const { return name_; }
  /// User of the file that was opened, whatever the name leads to by now.
  [[nodiscard]] std::uint32_t owner_uid() const;
  [[nodiscard]] std::uint32_t writer_pid() const;
  [[nodiscard]] std::uint32_t tick_ns() const;
  [[nodiscard]] std::int64_t start_realtime_ns() const;
  /// Of the memory for requests (ravencal/control.h), for shmat.
  [[nodiscard]] int request_id() const;
  /// Number of the request that the plugin took last.
  [[nodiscard]] std::uint64_t request_taken() const;
  [[nodiscard]] std::string plugin_version() const;

 private:
  struct Segment;
  TelemetryReader(std::string name, std::shared_ptr<const Segment> segment);
  [[nodiscard]] std::uint64_t word_at(std::size_t byte) const;
  template <typename Record>
  [[nodiscard]] std::optional<Record> guarded_record(std::size_t byte) const;
  [[nodiscard]] const ravencal_telemetry_label& label() const;

  std::string name_;
  std::shared_ptr<const Segment> segment_;
  std::uint64_t next_ = 0;
};

/// Names of all telemetry on this machine whose writer lives and is trusted
/// (TelemetryReader::open), "/ravencal-left" and so on, in order.
std::vector<std::string> telemetry_names(std::optional<std::uint32_t> user = {});

}  // namespace ravencal::monitor
