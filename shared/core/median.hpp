// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <vector>

namespace ravencal::core {

/// The middle value in order of size; of an even number of values the upper of the two in the
/// middle, so that it is always one of them. `values` must not be empty. O(n).
template <typename T>
T upper_median(std::vector<T> values) {
  assert(!values.empty());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace ravencal::core
