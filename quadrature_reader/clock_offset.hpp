// SPDX-License-Identifier: Apache-2.0
//
// How CLOCK_REALTIME (which robots and ROS use) stands to CLOCK_MONOTONIC (which we use).
#pragma once

#include <cstdint>

namespace ravencal::quadrature_reader {

struct ClockOffset {
  std::int64_t monotonic_ns = 0;    ///< when it was measured
  std::int64_t offset_ns = 0;       ///< CLOCK_REALTIME - CLOCK_MONOTONIC
  std::int64_t uncertainty_ns = 0;  ///< half of the time that the reading took
};

/// Reads both clocks several times and keeps the tightest reading.
ClockOffset measure_realtime_offset();

}  // namespace ravencal::quadrature_reader
