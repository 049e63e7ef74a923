// SPDX-License-Identifier: Apache-2.0
//
// The picture that `ravencal monitor` draws, as text; drawing it is the screen's work.
#pragma once

#include <string>
#include <vector>

#include "monitor/watch.hpp"

namespace ravencal::monitor {

/// What is shown beside the plugin itself.
struct Surroundings {
  std::string name;       ///< of the telemetry
  std::string notice;     ///< about the writer; empty: it writes
  std::string recording;  ///< about the recording; empty: none
  bool ascii = false;     ///< a terminal without Unicode
};

/// 23 lines of at most 80 columns.
std::vector<std::string> draw(const Watch& watch, const TelemetryReader& reader,
                              const Surroundings& surroundings);

/// One line for a log that is no terminal.
std::string draw_line(const Watch& watch, const Surroundings& surroundings);

/// The first `columns` columns of a UTF-8 text.
std::string clip(const std::string& text, std::size_t columns);

}  // namespace ravencal::monitor
