// SPDX-License-Identifier: Apache-2.0
//
// Telemetry made by hand, byte by byte as ravencal/telemetry.h says: what a plugin would write, and
// what only a plugin that was killed or is just writing leaves behind.
#pragma once

#include <cstdint>
#include <string>

#include "ravencal/telemetry.h"

namespace ravencal::test {

/// A name of this process that no other test uses; its file is removed at the end.
std::string telemetry_name(const std::string& ending);

/// A tick all of whose fields follow from its number, so that a torn one shows.
ravencal_tick tick_number(std::uint64_t number);
bool is_whole(const ravencal_tick& tick, std::uint64_t number);

class TelemetrySegment {
 public:
  explicit TelemetrySegment(const std::string& name, std::uint32_t slots = 64);
  TelemetrySegment(const TelemetrySegment&) = delete;
  TelemetrySegment& operator=(const TelemetrySegment&) = delete;
  ~TelemetrySegment();

  /// The next tick, as a plugin writes it.
  void write() { write(tick_number(header().written)); }
  void write(const ravencal_tick& tick);
  void close_in_order();
  /// What the end of a process does: the lock is gone, the file stays.
  void drop_lock();

  /// Puts the label of header() into the file too.
  void write_label();

  /// For damage: not atomic, so only while nobody reads.
  ravencal_telemetry_header& header() { return *static_cast<ravencal_telemetry_header*>(memory_); }
  ravencal_telemetry_slot& slot(std::uint64_t number);

 private:
  std::string path_;
  std::uint32_t slots_;
  int file_ = -1;
  void* memory_ = nullptr;
};

}  // namespace ravencal::test
