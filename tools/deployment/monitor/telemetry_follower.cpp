// SPDX-License-Identifier: Apache-2.0
#include "monitor/telemetry_follower.hpp"

#include <utility>

namespace ravencal::monitor {

Change TelemetryFollower::poll(std::vector<NumberedTick>& ticks) {
  if (writer_ == Writer::kAlive) {
    // First the state, then the ticks: what a writer wrote before its end is not missed.
    writer_ = reader_.writer();
    reader_.read(ticks);
    if (writer_ == Writer::kAlive) return Change::kNone;
    return writer_ == Writer::kEnded ? Change::kEnded : Change::kGone;
  }
  if (!reader_.is_replaced()) return Change::kNone;
  core::Result<TelemetryReader> next = TelemetryReader::open(reader_.name(), reader_.owner_uid());
  if (!next.ok()) return Change::kNone;
  reader_ = std::move(next).value();
  writer_ = Writer::kAlive;
  return Change::kAttached;
}

}  // namespace ravencal::monitor
