// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/sources/count_follower.hpp"

#include <algorithm>
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

double reach_counts(double counts_per_s, std::int64_t dt_ns) {
  return counts_per_s * 1e-9 * static_cast<double>(dt_ns + kStampJitterNs);
}

std::int64_t CountFollower::jump_counts(std::int64_t t_ns, std::int64_t moved) const {
  const std::int64_t apart_ns = t_ns - first_.t_ns;
  if (apart_ns <= 0) return first_.moved;
  // The joint went on meanwhile, as fast as the values after the jump say.
  const auto first = static_cast<double>(first_.moved);
  const double per_ns = (static_cast<double>(moved) - first) / static_cast<double>(apart_ns);
  const double jump = first - per_ns * static_cast<double>(first_.t_ns - *last_t_ns_);
  constexpr double kLargest = 9e15;  // whole numbers are exact in a double up to here
  return std::llround(std::clamp(jump, -kLargest, kLargest));
}

CountFollower::Step CountFollower::take(std::int64_t t_ns, std::uint64_t raw) {
  Step step;
  step.moved = widener_.movement_to(raw);
  if (max_counts_per_s_ > 0.0 && last_t_ns_ &&
      std::abs(static_cast<double>(step.moved)) > reach(*last_t_ns_, t_ns)) {
    const auto apart = static_cast<double>(widener_.distance(suspect_raw_, raw));
    const bool agrees = suspects_ > 0 && std::abs(apart) <= reach(suspect_t_ns_, t_ns);
    suspects_ = agrees ? suspects_ + 1 : 1;
    if (!agrees) first_ = {t_ns, step.moved};
    suspect_raw_ = raw;
    suspect_t_ns_ = t_ns;
    step.outcome = Outcome::kImplausible;
    if (suspects_ < kAgreeingSuspects) return step;
    step.outcome = Outcome::kRestarted;
    step.moved = jump_counts(t_ns, step.moved);
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
  return last_t_ns_ && reach(*last_t_ns_, t_ns) >= widener_.half_range();
}

}  // namespace ravencal::quadrature_reader
