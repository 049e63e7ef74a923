// SPDX-License-Identifier: Apache-2.0
//
// CAN frames to readings: positions in free layouts and CANopen CiA 406 (default TPDO1: object
// 6004h, 32 bits), heartbeat and boot-up of CiA 301, error frames, silence. Knows no socket.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "quadrature_reader/config.hpp"
#include "quadrature_reader/reading.hpp"
#include "quadrature_reader/sources/count_follower.hpp"

namespace ravencal::quadrature_reader {

/// A classic or FD frame. Flags in `id` as in linux/can.h: extended, remote, error.
struct CanFrame {
  std::int64_t t_ns = 0;  ///< CLOCK_MONOTONIC
  std::uint32_t id = 0;
  std::uint8_t length = 0;
  std::array<std::uint8_t, 64> data{};
};

inline constexpr std::uint32_t kCanExtendedFlag = 0x80000000U;
inline constexpr std::uint32_t kCanRemoteFlag = 0x40000000U;
inline constexpr std::uint32_t kCanErrorFlag = 0x20000000U;

/// The raw counter in `data`; nullopt if the frame is too short.
std::optional<std::uint64_t> extract_count(const CanEncoder& layout,
                                           std::span<const std::uint8_t> data);

class CanDecoder {
 public:
  explicit CanDecoder(const SourceSettings& settings);

  /// Appends what the frame says.
  void take(const CanFrame& frame, std::vector<Reading>& out);
  /// Appends what the absence of frames says. Call often; `now_ns` never decreases.
  void watch(std::int64_t now_ns, std::vector<Reading>& out);

  /// Nodes that booted and are to be started by an NMT command; cleared by the call.
  std::vector<unsigned> take_nodes_to_start();

 private:
  struct Node {
    CanEncoder layout;
    CountFollower follower;
    std::int64_t last_position_ns = 0;
    std::int64_t last_heartbeat_ns = 0;
    bool heard = false;           // a position has been received
    bool silent = false;          // its positions are late; reported
    bool heartbeat_late = false;  // reported
    bool stopped = false;         // not operational; reported
  };

  void take_error(const CanFrame& frame, std::vector<Reading>& out) const;
  void take_position(Node& node, const CanFrame& frame, std::vector<Reading>& out) const;
  void take_heartbeat(Node& node, const CanFrame& frame, std::vector<Reading>& out);

  std::int64_t position_timeout_ns_;
  std::int64_t heartbeat_timeout_ns_;
  bool start_nodes_;
  std::vector<Node> nodes_;
  std::vector<unsigned> nodes_to_start_;
  bool watching_ = false;
};

}  // namespace ravencal::quadrature_reader
