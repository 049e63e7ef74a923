// SPDX-License-Identifier: Apache-2.0
//
// Where readings come from: GPIO edges, CAN frames, counter chips, a recording.
#pragma once

#include <chrono>
#include <memory>
#include <vector>

#include "core/monotonic_clock.hpp"
#include "core/result.hpp"
#include "quadrature_reader/config.hpp"
#include "quadrature_reader/reading.hpp"

namespace ravencal::quadrature_reader {

/// One device. Used by one thread, after construction on another.
class Source {
 public:
  Source() = default;
  virtual ~Source() = default;
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  /// Opens the device; after a failed read() it may be called again.
  virtual core::Status open() = 0;

  /// Waits for readings, at most `timeout`, and appends them to `out` in time order, closed by a
  /// kAlive with kEveryAxis. An error means that the device is gone; what was read is in `out`.
  virtual core::Status read(std::vector<Reading>& out, std::chrono::milliseconds timeout) = 0;

  /// True if the source can be kept waiting when the ring is full (a recording can, a device not).
  [[nodiscard]] virtual bool patient() const { return false; }

  /// True once nothing more will come (a recording has been replayed).
  [[nodiscard]] virtual bool finished() const { return false; }
};

/// The source that `settings` describe, not opened yet.
core::Result<std::unique_ptr<Source>> make_source(const SourceSettings& settings);

using core::monotonic_now_ns;

}  // namespace ravencal::quadrature_reader
