// SPDX-License-Identifier: Apache-2.0
//
// Checks the count against index pulses: between two passes of the index the count must have
// changed by a whole number of revolutions. What is left over was lost or slipped.
#pragma once

#include <cstdint>
#include <optional>

namespace ravencal::quadrature_reader {

class IndexCheck {
 public:
  /// `counts_per_rev` counts between two index pulses; `tolerance_counts`: an index edge is not
  /// locked to A and B, so a count of difference is none.
  IndexCheck(std::int64_t counts_per_rev, std::int64_t tolerance_counts)
      : counts_per_rev_(counts_per_rev), tolerance_counts_(tolerance_counts) {}

  struct Pass {
    std::int64_t slip_counts =
        0;               ///< count minus what it should be, in (-rev/2, rev/2]; 0 within tolerance
    bool first = false;  ///< nothing to compare with yet
  };

  /// The Z line has changed to `level` at `count` while moving in `direction`. The pulse has a
  /// width: its lower flank is the rising edge going up and the falling edge going down; only that
  /// flank counts. nullopt: the other flank, or no direction. A slip is reported once: the pass
  /// that shows it is the new reference.
  std::optional<Pass> on_edge(bool level, int direction, std::int64_t count);

  [[nodiscard]] std::optional<std::int64_t> reference_counts() const { return reference_counts_; }
  /// Forget the reference, e.g. after the counter began again.
  void reset() { reference_counts_.reset(); }

 private:
  std::int64_t counts_per_rev_;
  std::int64_t tolerance_counts_;
  std::optional<std::int64_t> reference_counts_;
};

}  // namespace ravencal::quadrature_reader
