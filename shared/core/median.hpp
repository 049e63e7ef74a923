// SPDX-License-Identifier: Apache-2.0
//
// Order statistics, and scales that outliers do not bend. All of them are 0 of nothing, O(n), and
// take vectors of the standard library or of Eigen.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace ravencal::core {

/// Standard deviation of a normal distribution over the median of its absolute deviations:
/// 1 / Phi^-1(3/4) (Rousseeuw and Croux, JASA 1993).
inline constexpr double kNormalPerMad = 1.4826;

/// The value that at least `share` of the values stay below or equal; always one of them.
template <typename Values>
typename Values::value_type upper_quantile(Values values, double share) {
  const auto count = static_cast<std::ptrdiff_t>(values.size());
  if (count == 0) return {};
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(count));
  auto* const place = values.data() + std::min(rank, count - 1);
  std::nth_element(values.data(), place, values.data() + count);
  return *place;
}

/// The middle value in order of size; of an even number of values the upper of the two in the
/// middle, so that it is always one of them.
template <typename Values>
typename Values::value_type upper_median(Values values) {
  return upper_quantile(std::move(values), 0.5);
}

/// Standard deviation about `centre` of the normal distribution whose absolute deviations have this
/// median.
template <typename Values>
double normal_deviation(Values values, double centre = 0.0) {
  for (double& value : values) value = std::abs(value - centre);
  return kNormalPerMad * upper_median(std::move(values));
}

}  // namespace ravencal::core
