// SPDX-License-Identifier: Apache-2.0
//
// Follows one telemetry name over the ends and starts of its writers.
#pragma once

#include <vector>

#include "monitor/telemetry_reader.hpp"

namespace ravencal::monitor {

enum class Change {
  kNone,
  kEnded,     ///< the writer ended in order
  kGone,      ///< the writer's process is gone: killed or crashed
  kAttached,  ///< a new writer took the name; what it wrote comes with the next poll
};

class TelemetryFollower {
 public:
  explicit TelemetryFollower(TelemetryReader reader) : reader_(std::move(reader)) {}

  /// Appends the ticks since the last call. After kEnded and kGone no tick of that writer is left.
  Change poll(std::vector<NumberedTick>& ticks);

  [[nodiscard]] const TelemetryReader& reader() const { return reader_; }
  /// Of the writer that was followed last.
  [[nodiscard]] Writer writer() const { return writer_; }

 private:
  TelemetryReader reader_;
  Writer writer_ = Writer::kAlive;
};

}  // namespace ravencal::monitor
