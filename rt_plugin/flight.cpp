// SPDX-License-Identifier: Apache-2.0
#include "rt_plugin/flight.hpp"

namespace ravencal::rt {
namespace {

constexpr std::uint64_t kTicks = RAVENCAL_FLIGHT_TICKS;

}  // namespace

void FlightRecorder::record(const ravencal_tick& tick, bool faulted) noexcept {
  Buffer& buffer = buffers_[(faults_ + 1) % 2];
  store_record(buffer.ticks[next_].data(), tick);
  next_ = next_ + 1 == kTicks ? 0 : next_ + 1;
  count_ += count_ < kTicks ? 1 : 0;
  const bool ends = faulted && !faulted_;
  faulted_ = faulted;
  if (!ends) return;
  store_word(buffer.count, count_);
  store_word(buffer.next, next_);
  store_word(faults_, faults_ + 1);
  count_ = 0;
  next_ = 0;
}

bool FlightRecorder::copy(ravencal_flight& flight) const noexcept {
  for (;;) {
    const std::uint64_t faults = load_word(faults_);
    if (faults == 0) return false;
    const Buffer& buffer = buffers_[faults % 2];
    const std::uint64_t count = load_word(buffer.count);
    // Another FAULT during the copy may leave any pair behind; the indices stay in range.
    std::uint64_t from = (load_word(buffer.next) + kTicks - count) % kTicks;
    for (std::uint64_t i = 0; i < count; ++i) {
      flight.tick[i] = load_record<ravencal_tick>(buffer.ticks[from].data());
      from = from + 1 == kTicks ? 0 : from + 1;
    }
    if (load_word(faults_) != faults) continue;
    flight.ticks = static_cast<std::uint32_t>(count);
    flight.faults = faults;
    return true;
  }
}

}  // namespace ravencal::rt
