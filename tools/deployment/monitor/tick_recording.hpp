// SPDX-License-Identifier: Apache-2.0
//
// Stores every tick of the telemetry in a recording. What was lost is an event, never a row.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "core/result.hpp"
#include "monitor/telemetry_follower.hpp"
#include "record/recording_writer.hpp"

namespace ravencal::monitor {

class TickRecording {
 public:
  /// Errors: those of RecordingWriter::create.
  static core::Result<TickRecording> create(const std::filesystem::path& path,
                                            const TelemetryReader& reader);

  /// Ticks of one writer, in order. A number that is missing before this one becomes the event
  /// `gap`; a tick whose robot time runs back cannot be a row, and becomes the event `time_back`.
  core::Status append(const NumberedTick& tick);
  /// The writer ended, died or began: an event of that kind. After kAttached numbers start at 0.
  core::Status append(Change change, const TelemetryReader& reader);
  core::Status finish() { return writer_.finish(); }

  [[nodiscard]] std::uint64_t rows() const { return rows_; }
  [[nodiscard]] std::uint64_t not_stored() const { return not_stored_; }

 private:
  explicit TickRecording(record::RecordingWriter writer) : writer_(std::move(writer)) {}

  record::RecordingWriter writer_;
  std::optional<std::uint64_t> expected_;  ///< number of the next tick
  std::optional<std::int64_t> last_t_ns_;
  bool time_is_back_ = false;
  std::uint64_t rows_ = 0;
  std::uint64_t not_stored_ = 0;
};

}  // namespace ravencal::monitor
