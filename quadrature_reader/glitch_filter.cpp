// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/glitch_filter.hpp"

#include <iterator>

namespace ravencal::quadrature_reader {

void GlitchFilter::push(const Reading& reading) {
  if (reading.kind != ReadingKind::kEdge || shortest_pulse_ns_ == 0) {
    waiting_.push_back(reading);
    ready_ = waiting_.size();
    return;
  }
  advance(reading.t_ns);
  for (std::size_t i = waiting_.size(); i > ready_; --i) {
    const Reading& earlier = waiting_[i - 1];
    if (earlier.line != reading.line) continue;
    if (earlier.value == reading.value) break;  // the decoder handles repeated edges
    waiting_.erase(std::next(waiting_.begin(), static_cast<std::ptrdiff_t>(i - 1)));
    ++removed_pulses_;
    return;
  }
  waiting_.push_back(reading);
}

void GlitchFilter::advance(std::int64_t t_ns) {
  while (ready_ < waiting_.size() && t_ns - waiting_[ready_].t_ns >= shortest_pulse_ns_) ++ready_;
}

bool GlitchFilter::pop(Reading& reading) {
  if (ready_ == 0) return false;
  reading = waiting_.front();
  waiting_.pop_front();
  --ready_;
  return true;
}

}  // namespace ravencal::quadrature_reader
