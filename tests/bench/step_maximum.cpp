// SPDX-License-Identifier: Apache-2.0
#include "bench/step_maximum.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>

#include "core/monotonic_clock.hpp"

namespace ravencal::bench {

void Histogram::add(std::int64_t ns) {
  const auto width = static_cast<std::size_t>(std::bit_width(static_cast<std::uint64_t>(ns)));
  ++steps[std::min(width == 0 ? 0 : width - 1, kBins - 1)];
  longest_ns = std::max(longest_ns, ns);
}

Histogram time_back_to_back(Peer& peer, std::uint64_t steps) {
  Histogram histogram;
  std::array<float, 16> outputs;
  for (std::uint64_t i = 0; i < steps; ++i) {
    if (peer.prepare) peer.prepare();
    const std::int64_t before_ns = core::monotonic_now_ns();
    peer.step(outputs.data());
    histogram.add(core::monotonic_now_ns() - before_ns);
  }
  return histogram;
}

Peer empty_peer() {
  Peer peer;
  peer.name = "an empty step";
  peer.step = [](float* /*outputs*/) {};
  return peer;
}

bool is_listed(std::string_view cores, unsigned core) {
  const char* at = cores.data();
  const char* const end = at + cores.size();
  while (at < end) {
    unsigned first = 0;
    const auto [behind_first, error] = std::from_chars(at, end, first);
    if (error != std::errc{}) return false;
    unsigned last = first;
    at = behind_first;
    if (at < end && *at == '-') at = std::from_chars(at + 1, end, last).ptr;
    if (first <= core && core <= last) return true;
    if (at < end) ++at;  // the comma
  }
  return false;
}

std::string isolation_note(std::string_view isolated, unsigned core) {
  if (is_listed(isolated, core)) {
    return fmt::format("core {} is isolated: the scheduler puts no other process there", core);
  }
  return fmt::format(
      "core {} is not isolated (isolated: {}): the longest steps may hold other processes' work, "
      "and no "
      "bound is claimed",
      core, isolated.empty() ? "none" : isolated);
}

}  // namespace ravencal::bench
