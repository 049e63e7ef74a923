// SPDX-License-Identifier: Apache-2.0
//
// What the kernel says of a CAN interface (rtnetlink), for --check-setup: is it up, which bit rate,
// how the controller stands, does it come back by itself after bus-off.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "core/result.hpp"

namespace ravencal::quadrature_reader {

/// linux/can/netlink.h, enum can_state.
enum class CanState : std::uint32_t {
  kErrorActive,
  kErrorWarning,
  kErrorPassive,
  kBusOff,
  kStopped,
  kSleeping,
};

struct CanLink {
  bool is_can = false;  ///< not Ethernet or the like
  bool up = false;
  std::string kind;               ///< "can", "vcan", ...
  std::optional<CanState> state;  ///< none: a virtual interface has no controller
  std::uint32_t bitrate_hz = 0;   ///< 0: not set, or not told
  std::uint32_t restart_ms = 0;   ///< 0: stays off the bus after bus-off
};

/// The interface's description. Error kDevice where there is none of that name.
core::Result<CanLink> read_can_link(const std::string& interface);

/// The description in an RTM_NEWLINK message; error kData if it is none.
core::Result<CanLink> parse_can_link(std::span<const std::byte> message);

}  // namespace ravencal::quadrature_reader
