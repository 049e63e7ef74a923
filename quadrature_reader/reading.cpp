// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/reading.hpp"

namespace ravencal::quadrature_reader {

std::string_view name_of(Fault fault) {
  switch (fault) {
    case Fault::kNone:
      return "none";
    case Fault::kDeviceGone:
      return "device_gone";
    case Fault::kBusOff:
      return "bus_off";
    case Fault::kBusError:
      return "bus_error";
    case Fault::kBusRestarted:
      return "bus_restarted";
    case Fault::kNodeSilent:
      return "node_silent";
    case Fault::kHeartbeatLate:
      return "heartbeat_late";
    case Fault::kNodeStopped:
      return "node_stopped";
    case Fault::kQueueOverflow:
      return "queue_overflow";
    case Fault::kRingOverflow:
      return "ring_overflow";
    case Fault::kLateReading:
      return "late_reading";
    case Fault::kShortFrame:
      return "short_frame";
    case Fault::kImplausibleCount:
      return "implausible_count";
    case Fault::kMissingRows:
      return "missing_rows";
    case Fault::kInvalidTransition:
      return "invalid_transition";
    case Fault::kStampsHardware:
      return "stamps_hardware";
    case Fault::kStampsKernel:
      return "stamps_kernel";
    case Fault::kStampsArrival:
      return "stamps_arrival";
  }
  return "unknown";
}

}  // namespace ravencal::quadrature_reader
