// SPDX-License-Identifier: Apache-2.0
//
// Removes pulses shorter than a limit: two edges of one line, there and back, closer than that.
// They carry no movement. Every edge waits for as long as the limit, so order is kept and the
// output lags by it. Not thread-safe.
#pragma once

#include <cstdint>
#include <deque>

#include "quadrature_reader/reading.hpp"

namespace ravencal::quadrature_reader {

class GlitchFilter {
 public:
  /// `shortest_pulse_ns` = 0 passes everything at once.
  explicit GlitchFilter(std::int64_t shortest_pulse_ns) : shortest_pulse_ns_(shortest_pulse_ns) {}

  /// Takes a reading; readings that are not edges pass in order, and end the wait of all before.
  void push(const Reading& reading);
  /// Time has reached `t_ns`: edges that waited long enough become available.
  void advance(std::int64_t t_ns);
  /// Next reading that is through; false if there is none.
  bool pop(Reading& reading);

  /// Pulses removed so far, two edges each.
  [[nodiscard]] std::int64_t removed_pulses() const { return removed_pulses_; }

 private:
  std::int64_t shortest_pulse_ns_;
  std::int64_t removed_pulses_ = 0;
  std::deque<Reading> waiting_;
  std::size_t ready_ = 0;  // how many at the front of waiting_ are through
};

}  // namespace ravencal::quadrature_reader
