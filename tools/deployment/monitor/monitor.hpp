// SPDX-License-Identifier: Apache-2.0
//
// `ravencal monitor`: follows one telemetry, shows it and stores it until it is told to stop.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "core/result.hpp"

namespace ravencal::monitor {

struct Options {
  std::string name;   ///< of the telemetry; empty: the only one there is
  std::string user;   ///< whose telemetry is trusted besides root's and one's own, name or number
  bool json = false;  ///< a stream for programs instead of a picture
  double rate_hz = 10.0;  ///< pictures or JSON lines per second
  double duration_s = 0;  ///< 0: without end
  std::string recording;  ///< path of a recording of every tick; empty: none
};

/// Result of a run.
struct Outcome {
  std::string name;
  std::uint64_t ticks = 0;
  std::uint64_t missed = 0;
  std::uint64_t rows = 0;        ///< in the recording
  std::uint64_t not_stored = 0;  ///< ticks whose robot time ran back
};

/// Works until `keep_going` says no or the duration is over. Errors: kUsage if the name is none or
/// several could be meant, kIo and kData if there is no telemetry that can be read, and those of
/// the recording.
core::Result<Outcome> run(const Options& options, const std::function<bool()>& keep_going);

}  // namespace ravencal::monitor
