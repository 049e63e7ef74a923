// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/sources/count_follower.hpp"

#include <cmath>

namespace ravencal::quadrature_reader {
namespace {

// Values are stamped on arrival: two that were measured a period apart may bear nearly one stamp.
constexpr std::int64_t kStampJitterNs = 2'000'000;
// A corrupt value is alone; this many values that agree mean that the device restarted its count.
constexpr int kAgreeingSuspects = 3;

/// The value of `bits` bits as a two's complement number.
std::int64_t sign_extend(std::uint64_t value, unsigned bits) {
  const std::uint64_t sign = std::uint64_t{1} << (bits - 1);
  return static_cast<std::int64_t>(((value & low_bits(bits)) ^ sign) - sign);
}

}  // namespace

std::int64_t CountWidener::widen(std::uint64_t raw, bool is_signed) {
  raw &= low_bits(bits_);
  if (!started_) {
    count_ = is_signed ? sign_extend(raw, bits_) : static_cast<std::int64_t>(raw);
    started_ = true;
  } else {
    // Unsigned arithmetic: a counter of 64 bits may wrap.
    count_ = static_cast<std::int64_t>(static_cast<std::uint64_t>(count_) +
                                       static_cast<std::uint64_t>(movement_to(raw)));
  }
  last_raw_ = raw;
  return count_;
}

std::int64_t CountWidener::movement_to(std::uint64_t raw) const {
  return last_raw_ ? distance(*last_raw_, raw) : 0;
}

std::int64_t CountWidener::distance(std::uint64_t from, std::uint64_t to) const {
  return sign_extend(to - from, bits_);
}

double CountWidener::half_range() const { return std::ldexp(1.0, static_cast<int>(bits_) - 1); }

double CountFollower::reach_counts(std::int64_t since_ns, std::int64_t t_ns) const {
  return max_counts_per_s_ * 1e-9 * static_cast<double>(t_ns - since_ns + kStampJitterNs);
}

CountFollower::Step CountFollower::take(std::int64_t t_ns, std::uint64_t raw) {
  Step step;
  step.moved = widener_.movement_to(raw);
  if (max_counts_per_s_ > 0.0 && last_t_ns_ &&
      std::abs(static_cast<double>(step.moved)) > reach_counts(*last_t_ns_, t_ns)) {
    const auto apart = static_cast<double>(widener_.distance(suspect_raw_, raw));
    const bool agrees = suspects_ > 0 && std::abs(apart) <= reach_counts(suspect_t_ns_, t_ns);
    suspects_ = agrees ? suspects_ + 1 : 1;
    suspect_raw_ = raw;
    suspect_t_ns_ = t_ns;
    step.outcome = Outcome::kImplausible;
    if (suspects_ < kAgreeingSuspects) return step;
    step.outcome = Outcome::kRestarted;
    widener_.reanchor();
  }
  suspects_ = 0;
  last_t_ns_ = t_ns;
  step.count = widener_.widen(raw, is_signed_);
  return step;
}

void CountFollower::restart() {
  widener_.reanchor();
  last_t_ns_.reset();
  suspects_ = 0;
}

bool CountFollower::may_have_wrapped(std::int64_t t_ns) const {
  return last_t_ns_ && reach_counts(*last_t_ns_, t_ns) >= widener_.half_range();
}

}  // namespace ravencal::quadrature_reader
