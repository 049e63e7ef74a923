// SPDX-License-Identifier: Apache-2.0
//
// What every source of encoder data delivers: one small record per edge, count, loss or fault, in
// the order of its kernel time stamps. Plain data, so that it crosses threads through SpscRing.
// Times are CLOCK_MONOTONIC in ns.
#pragma once

#include <cstdint>
#include <string_view>

namespace ravencal::quadrature_reader {

enum class Line : std::uint8_t { kA, kB, kZ };

enum class ReadingKind : std::uint8_t {
  kEdge,       ///< `line` has changed to level `value` (0 or 1)
  kLevels,     ///< all lines were read: `value` = A | B << 1 | Z << 2
  kCount,      ///< a device that counts by itself says `value`, already widened to 64 bits
  kLost,       ///< `value` edges are missing before this instant; 0: some, number unknown
  kAlive,      ///< everything up to this instant has been delivered
  kRestarted,  ///< a counting device began again; its count has no relation to the one before;
               ///< `value` = by how many counts it jumped, where that is known
  kFault,      ///< the axis delivers nothing until further notice; `fault` says why
  kRecovered,  ///< it delivers again
  kNotice,     ///< something worth an event, without loss: `fault` says what, `value` how many
  kUnseen,     ///< the count moved by `value` (signed) before this instant, its edges are missing;
               ///< `fault` says how that is known; kLevels follows
  kWrapped,    ///< a raw counter wrapped: `value` was added to its counts, from here on
};

enum class Fault : std::uint8_t {
  kNone,
  kDeviceGone,         ///< read failed, chip unplugged, interface down; `value` = errno
  kBusOff,             ///< the CAN controller has left the bus
  kBusError,           ///< CAN error frame; `value` = its error class bits
  kBusRestarted,       ///< the CAN controller is back on the bus
  kNodeSilent,         ///< no position for longer than configured; `value` = ns
  kHeartbeatLate,      ///< no CANopen heartbeat for longer than configured; `value` = ns
  kNodeStopped,        ///< CANopen node not operational; `value` = its NMT state
  kQueueOverflow,      ///< the kernel dropped frames; `value` = how many
  kRingOverflow,       ///< our own writer was too slow; `value` = readings dropped
  kLateReading,        ///< a time stamp older than what was already delivered
  kShortFrame,         ///< frame too short for its layout; `value` = its length
  kImplausibleCount,   ///< a count that the joint cannot have reached, refused
  kMissingRows,        ///< the counts beside the lines say how many rows are gone
  kInvalidTransition,  ///< both lines changed at once; `value` follows from the pace around
  kStampsHardware,     ///< time stamps are the adapter's own from here on
  kStampsKernel,       ///< they are the kernel's, taken when the frame reached it
  kStampsArrival,      ///< they are ours, taken when the frame was read
};

std::string_view name_of(Fault fault);

/// The axis number that means every axis of the source.
inline constexpr std::uint8_t kEveryAxis = 255;

struct Reading {
  std::int64_t t_ns = 0;
  std::int64_t value = 0;
  std::uint8_t axis = 0;  ///< index of the [[encoder]] in the configuration, or kEveryAxis
  ReadingKind kind = ReadingKind::kEdge;
  Line line = Line::kA;
  Fault fault = Fault::kNone;
};

}  // namespace ravencal::quadrature_reader
