// SPDX-License-Identifier: Apache-2.0
#include "quadrature_reader/index_check.hpp"

#include <cstdlib>

namespace ravencal::quadrature_reader {

std::optional<IndexCheck::Pass> IndexCheck::on_edge(bool level, int direction, std::int64_t count) {
  if (direction == 0 || level != (direction > 0)) return std::nullopt;
  if (!reference_counts_) {
    reference_counts_ = count;
    return Pass{0, true};
  }
  std::int64_t slip = (count - *reference_counts_) % counts_per_rev_;
  if (2 * slip > counts_per_rev_) slip -= counts_per_rev_;
  if (2 * slip <= -counts_per_rev_) slip += counts_per_rev_;
  if (std::abs(slip) <= tolerance_counts_) return Pass{};
  reference_counts_ = count;
  return Pass{slip, false};
}

}  // namespace ravencal::quadrature_reader
