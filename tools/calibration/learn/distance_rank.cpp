// SPDX-License-Identifier: Apache-2.0
#include "learn/distance_rank.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

namespace ravencal::learn {
namespace {

constexpr double kStretchS = 1.0;
constexpr std::size_t kFewestStretches = 3;

/// From 0; equal values have the mean of their ranks.
Eigen::ArrayXd ranks_of(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  Eigen::ArrayXd ranks(std::ssize(values));
  for (std::size_t first = 0; first < order.size();) {
    std::size_t end = first + 1;
    while (end < order.size() && values[order[end]] == values[order[first]]) ++end;
    for (std::size_t i = first; i < end; ++i)
      ranks[static_cast<Eigen::Index>(order[i])] = 0.5 * static_cast<double>(first + end - 1);
    first = end;
  }
  return ranks;
}

double spearman(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() < kFewestStretches) return std::numeric_limits<double>::quiet_NaN();
  Eigen::ArrayXd x = ranks_of(a);
  Eigen::ArrayXd y = ranks_of(b);
  x -= x.mean();
  y -= y.mean();
  return (x * y).sum() / std::sqrt(x.square().sum() * y.square().sum());  // 0/0 if all are alike
}

}  // namespace

double distance_rank(const JointEvaluation& joint) {
  std::vector<double> distances;
  std::vector<double> squares;
  std::size_t first = 0;
  for (std::size_t row = 1; row <= joint.distance.size(); ++row) {
    const bool ends = row == joint.distance.size() || joint.t_s[row] < joint.t_s[row - 1] ||
                      joint.t_s[row] >= joint.t_s[first] + kStretchS;
    if (!ends) continue;
    double distance = 0.0;
    double square = 0.0;
    for (std::size_t i = first; i < row; ++i) {
      distance += joint.distance[i];
      square += std::pow(joint.corrected[i] - joint.truth[i], 2);
    }
    const auto rows = static_cast<double>(row - first);
    distances.push_back(distance / rows);
    squares.push_back(square / rows);
    first = row;
  }
  return spearman(distances, squares);
}

}  // namespace ravencal::learn
