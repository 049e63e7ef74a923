// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/sources/can_decoder.hpp"

#include <algorithm>
#include <utility>

namespace ravencal::quadrature_reader {
namespace {

// linux/can/error.h: error classes in the identifier of an error frame.
constexpr std::uint32_t kErrorBusOff = 0x40;
constexpr std::uint32_t kErrorRestarted = 0x100;
constexpr std::uint32_t kErrorClassMask = 0x1FFFFFFF;

// CiA 301: NMT error control on 0x700 + node; its states.
constexpr std::uint32_t kHeartbeat = 0x700;
constexpr std::uint8_t kBootUp = 0x00;
constexpr std::uint8_t kOperational = 0x05;
constexpr std::uint8_t kStateMask = 0x7F;  // bit 7 is node guarding's toggle bit

Reading reading(std::int64_t t_ns, std::int64_t value, std::uint8_t axis, ReadingKind kind,
                Fault fault = Fault::kNone) {
  return {t_ns, value, axis, kind, Line::kA, fault};
}

}  // namespace

std::optional<std::uint64_t> extract_count(const CanEncoder& layout,
                                           std::span<const std::uint8_t> data) {
  if (data.size() < layout.byte_offset + layout.byte_count) return std::nullopt;
  std::uint64_t raw = 0;
  for (unsigned i = 0; i < layout.byte_count; ++i) {
    const unsigned at = layout.big_endian ? i : layout.byte_count - 1 - i;
    raw = raw << 8U | data[layout.byte_offset + at];
  }
  return raw & low_bits(layout.counter_bits);
}

CanDecoder::CanDecoder(const SourceSettings& settings)
    : position_timeout_ns_(settings.position_timeout_ns),
      heartbeat_timeout_ns_(settings.heartbeat_timeout_ns),
      start_nodes_(settings.start_nodes) {
  for (const auto& layout : settings.can) {
    nodes_.push_back(
        {layout, CountFollower(layout.counter_bits, layout.is_signed, layout.max_counts_per_s)});
  }
}

void CanDecoder::take(const CanFrame& frame, std::vector<Reading>& out) {
  if ((frame.id & kCanErrorFlag) != 0) {
    take_error(frame, out);
    return;
  }
  if ((frame.id & kCanRemoteFlag) != 0) return;
  for (auto& node : nodes_) {
    const std::uint32_t wanted = node.layout.id | (node.layout.extended ? kCanExtendedFlag : 0);
    if (frame.id == wanted) take_position(node, frame, out);
    if (node.layout.canopen_node && frame.id == kHeartbeat + *node.layout.canopen_node &&
        frame.length > 0) {
      take_heartbeat(node, frame, out);
    }
  }
}

void CanDecoder::take_error(const CanFrame& frame, std::vector<Reading>& out) const {
  const std::uint32_t classes = frame.id & kErrorClassMask;
  if ((classes & kErrorBusOff) != 0) {
    out.push_back(reading(frame.t_ns, classes, kEveryAxis, ReadingKind::kFault, Fault::kBusOff));
  } else if ((classes & kErrorRestarted) != 0) {
    out.push_back(
        reading(frame.t_ns, classes, kEveryAxis, ReadingKind::kRecovered, Fault::kBusRestarted));
  } else {
    out.push_back(reading(frame.t_ns, classes, kEveryAxis, ReadingKind::kNotice, Fault::kBusError));
  }
}

void CanDecoder::take_position(Node& node, const CanFrame& frame, std::vector<Reading>& out) const {
  const auto raw = extract_count(
      node.layout, std::span(frame.data).first(std::min<std::size_t>(frame.length, 64)));
  const std::uint8_t axis = node.layout.axis;
  if (!raw) {
    out.push_back(
        reading(frame.t_ns, frame.length, axis, ReadingKind::kNotice, Fault::kShortFrame));
    return;
  }
  const bool was_silent = std::exchange(node.silent, false);
  node.last_position_ns = std::max(node.last_position_ns, frame.t_ns);
  node.heard = true;
  if (was_silent) {
    out.push_back(reading(frame.t_ns, 0, axis, ReadingKind::kRecovered, Fault::kNodeSilent));
    if (node.follower.may_have_wrapped(frame.t_ns)) {
      out.push_back(reading(frame.t_ns, 0, axis, ReadingKind::kRestarted));
      node.follower.restart();
    }
  }
  const auto step = node.follower.take(frame.t_ns, *raw);
  if (step.outcome == CountFollower::Outcome::kImplausible) {
    out.push_back(reading(frame.t_ns, 1, axis, ReadingKind::kLost, Fault::kImplausibleCount));
    return;
  }
  if (step.outcome == CountFollower::Outcome::kRestarted) {
    out.push_back(
        reading(frame.t_ns, step.moved, axis, ReadingKind::kRestarted, Fault::kImplausibleCount));
  }
  out.push_back(reading(frame.t_ns, step.count, axis, ReadingKind::kCount));
}

void CanDecoder::take_heartbeat(Node& node, const CanFrame& frame, std::vector<Reading>& out) {
  const std::uint8_t state = frame.data[0] & kStateMask;
  const std::uint8_t axis = node.layout.axis;
  node.last_heartbeat_ns = std::max(node.last_heartbeat_ns, frame.t_ns);
  if (std::exchange(node.heartbeat_late, false)) {
    out.push_back(reading(frame.t_ns, 0, axis, ReadingKind::kRecovered, Fault::kHeartbeatLate));
  }
  if (state == kBootUp) {
    // Its count has no relation to the one before; the first boot-up before any position is normal.
    if (node.heard) out.push_back(reading(frame.t_ns, 0, axis, ReadingKind::kRestarted));
    node.follower.restart();
    if (start_nodes_) nodes_to_start_.push_back(*node.layout.canopen_node);
    return;
  }
  const bool stopped = state != kOperational;
  if (stopped && !node.stopped) {
    out.push_back(reading(frame.t_ns, state, axis, ReadingKind::kFault, Fault::kNodeStopped));
  } else if (!stopped && node.stopped) {
    out.push_back(reading(frame.t_ns, 0, axis, ReadingKind::kRecovered, Fault::kNodeStopped));
  }
  node.stopped = stopped;
}

void CanDecoder::watch(std::int64_t now_ns, std::vector<Reading>& out) {
  for (auto& node : nodes_) {
    if (!watching_) node.last_position_ns = node.last_heartbeat_ns = now_ns;
    const auto tell = [&](Fault fault, std::int64_t since_ns, std::int64_t limit_ns, bool& told) {
      if (told || limit_ns <= 0 || now_ns - since_ns <= limit_ns) return;
      told = true;
      out.push_back(
          reading(now_ns, now_ns - since_ns, node.layout.axis, ReadingKind::kFault, fault));
    };
    tell(Fault::kNodeSilent, node.last_position_ns, position_timeout_ns_, node.silent);
    if (node.layout.canopen_node) {
      tell(Fault::kHeartbeatLate, node.last_heartbeat_ns, heartbeat_timeout_ns_,
           node.heartbeat_late);
    }
  }
  watching_ = true;
}

std::vector<unsigned> CanDecoder::take_nodes_to_start() {
  return std::exchange(nodes_to_start_, {});
}

}  // namespace ravencal::quadrature_reader
