// SPDX-License-Identifier: Apache-2.0
#include "diagnose/explain/repetition.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// More rows make the comparison slower and not better: those of a pass resemble each other.
constexpr Index kMostAsked = 1000;
constexpr Index kMostKnown = 6000;

/// Sums over the rows of a pass.
struct Sums {
  double left = 0.0, half_difference2 = 0.0, distance2 = 0.0, rows = 0.0;

  void add(const Sums& other) {
    left += other.left;
    half_difference2 += other.half_difference2;
    distance2 += other.distance2;
    rows += other.rows;
  }
  [[nodiscard]] double excess(double per_floor) const {
    return (left - per_floor * half_difference2) / rows;
  }
};

Index stride_for(Index rows, Index most) { return std::max<Index>(1, (rows + most - 1) / most); }

/// Squared distance to the nearest row that may be compared, and which; none: infinite.
std::pair<double, Index> nearest(const Passes& passes, Index row) {
  const VectorXd at = passes.circumstances.col(row);
  const int own = passes.pass[static_cast<std::size_t>(row)];
  std::pair<double, Index> best{std::numeric_limits<double>::infinity(), 0};
  const Index stride = stride_for(passes.residual.size(), kMostKnown);
  for (Index j = 0; j < passes.residual.size(); j += stride) {
    // Passes that touch share noise.
    if (std::abs(passes.pass[static_cast<std::size_t>(j)] - own) < 2) continue;
    const double d = (passes.circumstances.col(j) - at).squaredNorm();
    if (d < best.first) best = {d, j};
  }
  return best;
}

/// By pass; passes without a comparable row are left out.
std::vector<Sums> sums_of(const Passes& passes) {
  std::vector<Sums> sums(static_cast<std::size_t>(passes.pass.back()) + 1);
  const Index stride = stride_for(passes.residual.size(), kMostAsked);
  for (Index i = 0; i < passes.residual.size(); i += stride) {
    const int pass = passes.pass[static_cast<std::size_t>(i)];
    const auto [distance2, row] = nearest(passes, i);
    if (!std::isfinite(distance2)) continue;
    const double difference = passes.residual[i] - passes.residual[row];
    sums[static_cast<std::size_t>(pass)].add(
        {passes.residual[i] * passes.residual[i], 0.5 * difference * difference, distance2, 1.0});
  }
  std::erase_if(sums, [](const Sums& s) { return s.rows == 0.0; });
  return sums;
}

/// Standard error of the ratio of sums over passes, linearised (Cochran, Sampling Techniques 1977).
double excess_deviation(const std::vector<Sums>& sums, const Sums& total, double per_floor) {
  const auto count = static_cast<double>(sums.size());
  if (count < 2.0) return std::numeric_limits<double>::infinity();
  double square = 0.0;
  for (const Sums& s : sums)
    square += std::pow((s.excess(per_floor) - total.excess(per_floor)) * s.rows, 2);
  return std::sqrt(square * count / (count - 1.0)) / total.rows;
}

}  // namespace

std::optional<Repetition> repetition_of(const Passes& passes, double per_floor) {
  if (passes.pass.empty()) return std::nullopt;
  const std::vector<Sums> sums = sums_of(passes);
  if (sums.empty()) return std::nullopt;
  Sums total;
  for (const Sums& s : sums) total.add(s);
  Repetition found;
  found.left = total.left / total.rows;
  found.differs = total.half_difference2 / total.rows;
  found.excess_deviation = excess_deviation(sums, total, per_floor);
  // Rows that have nothing to do with each other are sqrt(2) deviations apart in each quantity.
  const auto quantities = static_cast<double>(std::max<Index>(1, passes.circumstances.rows()));
  found.agreement = std::max(0.0, 1.0 - total.distance2 / (2.0 * quantities * total.rows));
  found.rows = static_cast<std::size_t>(total.rows);
  found.passes = sums.size();
  return found;
}

}  // namespace ravencal::diagnose
