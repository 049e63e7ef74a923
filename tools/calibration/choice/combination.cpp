// SPDX-License-Identifier: Apache-2.0
#include "choice/combination.hpp"

#include <algorithm>
#include <cmath>
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

/// Mean squared error per part of what the other parts chose: the best trial, and a mean.
struct Judged {
  std::vector<double> single;
  std::vector<double> mean;
};

Products sum_of(const PartProducts& parts) {
  Products sum = parts.front();
  for (std::size_t p = 1; p < parts.size(); ++p) sum += parts[p];
  return sum;
}

Judged judge(const PartProducts& parts) {
  Judged judged;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    PartProducts others = parts;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(p));
    const Eigen::VectorXd weights = greedy_weights(sum_of(others));
    const Index best = best_of(others);
    judged.single.push_back(parts[p](best, best));
    judged.mean.push_back(weights.dot(parts[p] * weights));
  }
  return judged;
}

bool mean_is_better(const Judged& judged) {
  std::vector<double> gains;
  for (std::size_t p = 0; p < judged.single.size(); ++p)
    gains.push_back(judged.single[p] - judged.mean[p]);
  return mean_of(gains) > standard_error(gains);
}

}  // namespace

std::vector<Member> combine(std::span<const Trial> trials) {
  const PartProducts parts = products_of(trials);
  if (!mean_is_better(judge(parts))) return {{static_cast<std::size_t>(best_of(parts)), 1.0}};
  Eigen::VectorXd weights = greedy_weights(sum_of(parts));
  weights = (weights.array() < kLeastWeight).select(0.0, weights);
  weights /= weights.sum();
  std::vector<Member> members;
  for (Index t = 0; t < weights.size(); ++t) {
    if (weights[t] > 0.0) members.push_back({static_cast<std::size_t>(t), weights[t]});
  }
  return members;
}

double rmse_error(const Trial& trial) {
  const std::span<const Eigen::VectorXd> lists(trial.left);
  const std::vector<double> squares = mean_squares(lists.first(lists.size() - 1));
  const double mean = mean_of(squares);
  return mean > 0.0 ? standard_error(squares) / (2.0 * std::sqrt(mean)) : 0.0;
}

}  // namespace ravencal::choice
