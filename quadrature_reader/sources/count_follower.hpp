// SPDX-License-Identifier: Apache-2.0
//
// Follows the counter of a device that counts by itself (CAN node, counter chip): widens it to
// 64 bits through its wraps, and refuses values that the joint cannot have reached, so that a
// corrupt value or a device that began again never becomes a jump. Times in ns, any one clock.
#pragma once

#include <cstdint>
#include <optional>

namespace ravencal::quadrature_reader {

/// All `bits` lowest bits set, 1 to 64.
constexpr std::uint64_t low_bits(unsigned bits) {
  return bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
}

/// How far a joint gets in `dt_ns` at that speed, with what the jitter of stamps hides.
double reach_counts(double counts_per_s, std::int64_t dt_ns);

/// Widens a counter that wraps at 2^bits to 64 bits: between two readings it moves by less than
/// half of its range.
class CountWidener {
 public:
  explicit CountWidener(unsigned bits) : bits_(bits) {}
  /// `raw` modulo 2^bits. The first one is taken as it stands, sign-extended if `is_signed`.
  std::int64_t widen(std::uint64_t raw, bool is_signed);
  /// By how much widen() would change the count; 0 for the first.
  [[nodiscard]] std::int64_t movement_to(std::uint64_t raw) const;
  /// The shorter way from one raw value to another, signed.
  [[nodiscard]] std::int64_t distance(std::uint64_t from, std::uint64_t to) const;
  /// The counter begins again: the count goes on from where it was, whatever raw comes next.
  void reanchor() { last_raw_.reset(); }
  /// 2^(bits-1): from here on a movement is ambiguous.
  [[nodiscard]] double half_range() const;

 private:
  unsigned bits_;
  bool started_ = false;
  std::optional<std::uint64_t> last_raw_;
  std::int64_t count_ = 0;
};

class CountFollower {
 public:
  enum class Outcome : std::uint8_t {
    kCount,        ///< `count` is the present count
    kImplausible,  ///< too far from the last; `moved` says how far; refused
    kRestarted,    ///< several values agree on another place: the device began again; `count` as
                   ///< before it did
  };
  struct Step {
    Outcome outcome = Outcome::kCount;
    std::int64_t count = 0;
    std::int64_t moved = 0;  ///< kRestarted: the jump, without the motion beside it
  };

  /// `max_counts_per_s`: the joint cannot be faster; 0: every value is believed.
  CountFollower(unsigned bits, bool is_signed, double max_counts_per_s)
      : widener_(bits), is_signed_(is_signed), max_counts_per_s_(max_counts_per_s) {}

  Step take(std::int64_t t_ns, std::uint64_t raw);
  /// The device said that it began again.
  void restart();
  /// True if the counter may have wrapped unseen since its last value.
  [[nodiscard]] bool may_have_wrapped(std::int64_t t_ns) const;

 private:
  struct Suspect {
    std::int64_t t_ns = 0;
    std::int64_t moved = 0;  // since the last value that was believed
  };
  [[nodiscard]] double reach(std::int64_t since_ns, std::int64_t t_ns) const {
    return reach_counts(max_counts_per_s_, t_ns - since_ns);
  }
  [[nodiscard]] std::int64_t jump_counts(std::int64_t t_ns, std::int64_t moved) const;

  CountWidener widener_;
  bool is_signed_;
  double max_counts_per_s_;
  std::optional<std::int64_t> last_t_ns_;
  Suspect first_;                  // of those that agree
  std::uint64_t suspect_raw_ = 0;  // the last value refused
  std::int64_t suspect_t_ns_ = 0;
  int suspects_ = 0;  // how many refused values in a row agree
};

}  // namespace ravencal::quadrature_reader
