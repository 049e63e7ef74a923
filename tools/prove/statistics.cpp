// SPDX-License-Identifier: Apache-2.0
#include "prove/statistics.hpp"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <cmath>

#include "prove/generator/random.hpp"

namespace ravencal::prove {
namespace {

using Intervals = std::vector<std::pair<double, double>>;

Intervals merged(Intervals list) {
  std::sort(list.begin(), list.end());
  Intervals out;
  for (const auto& [a, b] : list) {
    if (b <= a) continue;
    if (!out.empty() && a <= out.back().second)
      out.back().second = std::max(out.back().second, b);
    else
      out.emplace_back(a, b);
  }
  return out;
}

double length(const Intervals& list) {
  double sum = 0.0;
  for (const auto& [a, b] : list) sum += b - a;
  return sum;
}

}  // namespace

std::pair<double, double> wilson(const Share& share) {
  if (share.of == 0) return {0.0, 1.0};
  constexpr double kZ = 1.959964;
  const double n = share.of, p = share.value(), z2 = kZ * kZ;
  const double centre = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
  const double half = kZ / (1.0 + z2 / n) * std::sqrt(p * (1.0 - p) / n + z2 / (4.0 * n * n));
  return {share.hits == 0 ? 0.0 : centre - half, share.hits == share.of ? 1.0 : centre + half};
}

double clopper_pearson_upper(const Share& share) {
  if (share.of == 0 || share.hits == share.of) return 1.0;
  return boost::math::binomial_distribution<>::find_upper_bound_on_p(share.of, share.hits, 0.025);
}

double median_of(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

std::pair<double, double> bootstrap_median(const std::vector<double>& values) {
  if (values.empty()) return {0.0, 0.0};
  constexpr int kResamples = 2000;
  Random random(1, "bootstrap");
  std::vector<double> medians, drawn(values.size());
  for (int r = 0; r < kResamples; ++r) {
    for (double& value : drawn) value = values[random.below(values.size())];
    medians.push_back(median_of(drawn));
  }
  std::sort(medians.begin(), medians.end());
  return {medians[kResamples / 40], medians[kResamples - 1 - kResamples / 40]};
}

double interval_overlap(Intervals a, Intervals b) {
  a = merged(std::move(a));
  b = merged(std::move(b));
  Intervals all = a;
  all.insert(all.end(), b.begin(), b.end());
  const double whole = length(merged(all));
  return whole > 0.0 ? (length(a) + length(b) - whole) / whole : 0.0;
}

}  // namespace ravencal::prove
