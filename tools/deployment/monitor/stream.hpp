// SPDX-License-Identifier: Apache-2.0
//
// The monitor for programs: one JSON object per line, in SI units.
#pragma once

#include <string>
#include <string_view>

#include "monitor/watch.hpp"

namespace ravencal::monitor {

/// The newest tick with the counters, one line with its end; empty if there is no tick yet.
/// "state" is "stalled" where the loop has stopped; "last_state" is what the newest tick says.
std::string tick_json(const Watch& watch);

/// Something about the writer: "attached", "writer_ended" or "writer_gone"; one line with its end.
std::string event_json(std::string_view event, const TelemetryReader& reader);

}  // namespace ravencal::monitor
