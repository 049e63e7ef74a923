// SPDX-License-Identifier: Apache-2.0
//
// The longest of very many steps back to back, beside that of as many empty steps: what the
// machine itself adds.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "bench/step_peers.hpp"

namespace ravencal::bench {

struct Histogram {
  /// Step times from 2^k to 2^(k + 1) ns; the first from 0, the last without end.
  static constexpr std::size_t kBins = 32;
  std::array<std::uint64_t, kBins> steps{};
  std::int64_t longest_ns = 0;

  void add(std::int64_t ns);
};

/// Times `steps` steps, each after peer.prepare.
Histogram time_back_to_back(Peer& peer, std::uint64_t steps);

/// A step that does nothing.
Peer empty_peer();

/// Whether `core` is in a list of the kernel's, such as "2-3,6".
bool is_listed(std::string_view cores, unsigned core);

/// What the longest step may be taken for, given /sys/devices/system/cpu/isolated.
std::string isolation_note(std::string_view isolated, unsigned core);

}  // namespace ravencal::bench
