// SPDX-License-Identifier: Apache-2.0
#include "simulation/truth_stream.hpp"

#include <algorithm>
#include <cmath>

namespace ravencal::simulation {
namespace {
constexpr std::size_t kKeptReadings = 64;  // over half a second: far more than a row ever waits
}

TruthStream::TruthStream(const physics::Logger& logger, std::uint64_t seed)
    : logger_(logger), random_(seed), next_reading_s_(random_.uniform() * logger.truth_period_s) {}

void TruthStream::observe(double t_s, const EncoderCounts& counts) {
  if (t_s < next_reading_s_) return;
  while (next_reading_s_ <= t_s) next_reading_s_ += logger_.truth_period_s;
  const double latency_s =
      std::max(0.0, logger_.truth_latency_s + logger_.truth_latency_deviation_s * random_.normal());
  const double last_s = readings_.empty() ? 0.0 : readings_.back().stamp_s;
  readings_.push_back({std::max(last_s, t_s + latency_s), counts});  // lines arrive in order
  if (readings_.size() > kKeptReadings) readings_.pop_front();
}

std::optional<EncoderCounts> TruthStream::nearest(double t_s, bool final) const {
  if (readings_.empty() || (!final && readings_.back().stamp_s < t_s)) return std::nullopt;
  const auto best =
      std::min_element(readings_.begin(), readings_.end(), [&](const Reading& a, const Reading& b) {
        return std::abs(a.stamp_s - t_s) < std::abs(b.stamp_s - t_s);
      });
  return best->counts;
}

}  // namespace ravencal::simulation
