// SPDX-License-Identifier: Apache-2.0
#include "choice/combination.hpp"

#include <algorithm>
#include <limits>

namespace ravencal::choice {
namespace {

using Eigen::Index;

/// Weights are multiples of one over this number.
constexpr int kGreedySteps = 30;
/// A member of less weight is left out: it costs as much time in the loop as any other.
constexpr double kLeastWeight = 0.1;

/// Mean products of the trials' residuals over a list of rows, over the least mean square of a
/// trial: what a mean of trials costs.
using Products = Eigen::MatrixXd;
using PartProducts = std::vector<Products>;

PartProducts products_of(std::span<const Trial> trials) {
  PartProducts result;
  for (std::size_t p = 0; p < trials.front().left.size(); ++p) {
    const Index rows = trials.front().left[p].size();
    if (rows == 0) continue;
    Eigen::MatrixXd left(rows, static_cast<Index>(trials.size()));
    for (std::size_t t = 0; t < trials.size(); ++t)
      left.col(static_cast<Index>(t)) = trials[t].left[p];
    Products products = left.transpose() * left / static_cast<double>(rows);
    const double least = products.diagonal().minCoeff();
    if (least > 0.0) products /= least;
    result.push_back(std::move(products));
  }
  return result;
}

/// By the rule of simplest_of_best.
Index best_of(const PartProducts& parts) {
  std::vector<std::vector<double>> squares(static_cast<std::size_t>(parts.front().rows()));
  for (std::size_t t = 0; t < squares.size(); ++t) {
    for (const Products& part : parts)
      squares[t].push_back(part(static_cast<Index>(t), static_cast<Index>(t)));
  }
  return static_cast<Index>(simplest_of_best(squares));
}

/// Weights [trials] of at most kMostMembers trials.
Eigen::VectorXd greedy_weights(const Products& products) {
  const Index count = products.rows();
  Eigen::VectorXd votes = Eigen::VectorXd::Zero(count);
  for (int step = 0; step < kGreedySteps; ++step) {
    const bool full = (votes.array() > 0.0).count() >= static_cast<Index>(kMostMembers);
    Index best = -1;
    double least = std::numeric_limits<double>::infinity();
    for (Index t = 0; t < count; ++t) {
      if (full && !(votes[t] > 0.0)) continue;
      votes[t] += 1.0;
      const double squares = votes.dot(products * votes) / (votes.sum() * votes.sum());
      votes[t] -= 1.0;
      if (squares < least) {
        least = squares;
        best = t;
      }
    }
    if (best < 0) break;
    votes[best] += 1.0;
  }
  return votes / votes.sum();
}

Products sum_of(const PartProducts& parts) {
  Products sum = parts.front();
  for (std::size_t p = 1; p < parts.size(); ++p) sum += parts[p];
  return sum;
}

/// [trials], 1 at the best.
Eigen::VectorXd best_alone(const PartProducts& parts) {
  return Eigen::VectorXd::Unit(parts.front().rows(), best_of(parts));
}

Eigen::VectorXd mean_weights(const PartProducts& parts) {
  Eigen::VectorXd weights = greedy_weights(sum_of(parts));
  weights = (weights.array() < kLeastWeight).select(0.0, weights);
  return weights / weights.sum();
}

/// Whether a mean is better than the best alone, each chosen without the part that judges it.
bool mean_is_better(const PartProducts& parts) {
  std::vector<double> gains;
  for (std::size_t p = 0; p < parts.size() && parts.size() > 1; ++p) {
    PartProducts others = parts;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(p));
    const auto squares = [&](const Eigen::VectorXd& weights) {
      return weights.dot(parts[p] * weights);
    };
    gains.push_back(squares(best_alone(others)) - squares(mean_weights(others)));
  }
  return mean_of(gains) > standard_error(gains);
}

Eigen::VectorXd chosen_weights(const PartProducts& parts) {
  return mean_is_better(parts) ? mean_weights(parts) : best_alone(parts);
}

Eigen::VectorXd weighted_left(std::span<const Trial> trials, const Eigen::VectorXd& weights,
                              std::size_t list) {
  Eigen::VectorXd left = Eigen::VectorXd::Zero(trials.front().left[list].size());
  for (std::size_t t = 0; t < trials.size(); ++t)
    left += weights[static_cast<Index>(t)] * trials[t].left[list];
  return left;
}

}  // namespace

Combination combine(std::span<const Trial> trials) {
  const PartProducts parts = products_of(trials);
  const Eigen::VectorXd weights = chosen_weights(parts);
  Combination combination;
  for (Index t = 0; t < weights.size(); ++t) {
    if (weights[t] > 0.0) combination.members.push_back({static_cast<std::size_t>(t), weights[t]});
  }
  std::size_t part = 0;
  for (std::size_t list = 0; list < trials.front().left.size(); ++list) {
    if (trials.front().left[list].size() == 0) continue;
    PartProducts others = parts;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(part++));
    combination.judged.push_back(
        weighted_left(trials, others.empty() ? weights : chosen_weights(others), list));
  }
  return combination;
}

}  // namespace ravencal::choice
