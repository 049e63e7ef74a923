// SPDX-License-Identifier: Apache-2.0
//
// The three settings in which bench_step times a step, and what it makes of the samples.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "bench/step_peers.hpp"

namespace ravencal::bench {

/// Memory in huge pages where the system gives them, zeroed.
std::shared_ptr<std::byte[]> huge_bytes(std::size_t bytes);

/// Reads `bytes` (a multiple of 512) bytes as fast as one core can.
float read_bytes(const std::byte* at, std::size_t bytes);

enum class Setting : std::uint8_t { kWarm, kEvicted, kLoop };
inline constexpr std::array<const char*, 3> kSettingNames = {"warm", "evicted", "1 ms loop"};

struct Quantiles {
  /// The lowest of the bursts' medians: a busy machine raises a median, nothing lowers one.
  double p50_ns = 0.0;
  // Of all samples.
  double p99_ns = 0.0;
  double p999_ns = 0.0;
  double max_ns = 0.0;
};

struct Effort {
  int bursts = 5;         ///< rounds over all peers, so that a busy moment hits all of them
  int warm_steps = 400;   ///< per burst
  int cold_steps = 40;    ///< per burst, each after 64 MiB of other reads
  int loop_ticks = 1000;  ///< per burst, each after a millisecond with 4 MiB of other work
};

using PeerTimes = std::array<Quantiles, kSettingNames.size()>;

/// Times every peer in every setting.
std::vector<PeerTimes> time_peers(std::vector<Peer>& peers, const Effort& effort);

}  // namespace ravencal::bench
