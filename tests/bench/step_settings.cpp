// SPDX-License-Identifier: Apache-2.0
#include "bench/step_settings.hpp"

#include <algorithm>

#include "core/monotonic_clock.hpp"

namespace ravencal::bench {
namespace {

constexpr std::int64_t kPeriodNs = 1'000'000;
constexpr std::size_t kOtherBytes = std::size_t{64} << 20U;
constexpr std::size_t kOtherBytesPerTick = std::size_t{4} << 20U;

/// What the rest of a control process does to the caches.
class OtherWork {
 public:
  void all() { sink_ = sink_ + read_bytes(memory_.get(), kOtherBytes); }
  void one_tick() {
    at_ = (at_ + kOtherBytesPerTick) % kOtherBytes;
    sink_ = sink_ + read_bytes(memory_.get() + at_, kOtherBytesPerTick);
  }

 private:
  std::shared_ptr<std::byte[]> memory_ = huge_bytes(kOtherBytes);
  std::size_t at_ = 0;
  volatile float sink_ = 0.0F;
};

using Samples = std::vector<double>;

double quantile(const Samples& sorted, double q) {
  const auto at = static_cast<std::size_t>(q * static_cast<double>(sorted.size()));
  return sorted.empty() ? 0.0 : sorted[std::min(sorted.size() - 1, at)];
}

Quantiles quantiles_of(std::vector<Samples>& bursts) {
  Quantiles result;
  Samples all;
  for (Samples& burst : bursts) {
    std::sort(burst.begin(), burst.end());
    const double p50_ns = quantile(burst, 0.5);
    if (result.p50_ns == 0.0 || p50_ns < result.p50_ns) result.p50_ns = p50_ns;
    all.insert(all.end(), burst.begin(), burst.end());
  }
  std::sort(all.begin(), all.end());
  result.p99_ns = quantile(all, 0.99);
  result.p999_ns = quantile(all, 0.999);
  result.max_ns = all.empty() ? 0.0 : all.back();
  return result;
}

double time_step(Peer& peer) {
  std::array<float, 16> outputs;
  const std::int64_t before_ns = core::monotonic_now_ns();
  peer.step(outputs.data());
  return static_cast<double>(core::monotonic_now_ns() - before_ns);
}

void prepare(Peer& peer) {
  if (peer.prepare) peer.prepare();
}

Samples burst(Peer& peer, Setting setting, const Effort& effort, OtherWork& other) {
  Samples samples;
  if (setting == Setting::kWarm) {
    for (int i = -effort.warm_steps / 8; i < effort.warm_steps; ++i) {
      prepare(peer);
      const double ns = time_step(peer);
      if (i >= 0) samples.push_back(ns);
    }
  } else if (setting == Setting::kEvicted) {
    for (int i = 0; i < effort.cold_steps; ++i) {
      prepare(peer);
      other.all();
      samples.push_back(time_step(peer));
    }
  } else {
    std::int64_t next_ns = core::monotonic_now_ns() + kPeriodNs;
    for (int i = -1; i < effort.loop_ticks; ++i, next_ns += kPeriodNs) {
      prepare(peer);
      other.one_tick();
      core::sleep_until(next_ns);
      const double ns = time_step(peer);
      if (i >= 0) samples.push_back(ns);
    }
  }
  return samples;
}

}  // namespace

std::vector<PeerTimes> time_peers(std::vector<Peer>& peers, const Effort& effort) {
  OtherWork other;
  std::vector<std::array<std::vector<Samples>, kSettingNames.size()>> samples(peers.size());
  for (int round = 0; round < effort.bursts; ++round) {
    for (std::size_t p = 0; p < peers.size(); ++p) {
      for (std::size_t s = 0; s < kSettingNames.size(); ++s) {
        samples[p][s].push_back(burst(peers[p], static_cast<Setting>(s), effort, other));
      }
    }
  }
  std::vector<PeerTimes> times(peers.size());
  for (std::size_t p = 0; p < peers.size(); ++p) {
    for (std::size_t s = 0; s < kSettingNames.size(); ++s)
      times[p][s] = quantiles_of(samples[p][s]);
  }
  return times;
}

}  // namespace ravencal::bench
