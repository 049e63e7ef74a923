// SPDX-License-Identifier: Apache-2.0
#include "diagnose/fit/sign_flip.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

VectorXd random_signs(Index count, std::mt19937_64& engine) {
  VectorXd signs(count);
  std::uint64_t bits = 0;
  for (Index i = 0; i < count; ++i) {
    if (i % 64 == 0) bits = engine();
    signs[i] = (bits & 1U) != 0 ? 1.0 : -1.0;
    bits >>= 1U;
  }
  return signs;
}

/// The gains that chance makes of one option, as a scaled chi-squared of the same mean and
/// variance, and that as a normal (Wilson and Hilferty, PNAS 1931): gains of few and of many
/// columns, of even and of uneven blocks are equally unlikely where the normal is the same.
class Chance {
 public:
  explicit Chance(const VectorXd& gains) : mean_(std::max(gains.mean(), 1e-300)) {
    const double variance = (gains.array() - mean_).square().mean();
    ninth_ = std::clamp(variance / (9.0 * mean_ * mean_), 1e-6, 1.0);
  }
  [[nodiscard]] double normal(double gain) const {
    return (std::cbrt(gain / mean_) - 1.0 + ninth_) / std::sqrt(ninth_);
  }
  [[nodiscard]] double gain(double normal) const {
    return mean_ * std::pow(1.0 - ninth_ + normal * std::sqrt(ninth_), 3);
  }

 private:
  double mean_;
  double ninth_;  ///< 2 / 9 over the degrees of freedom
};

/// Sums of these values over all patterns of their signs, in order of size.
std::vector<double> sums_of_patterns(const VectorXd& values) {
  std::vector<double> sums = {0.0};
  for (const double value : values) {
    const std::size_t count = sums.size();
    for (std::size_t i = 0; i < count; ++i) {
      sums.push_back(sums[i] + value);
      sums[i] -= value;
    }
  }
  std::sort(sums.begin(), sums.end());
  return sums;
}

/// Values whose patterns can all be listed: neighbours share one of `kMostExactFlips` sums.
VectorXd few_enough(const VectorXd& values) {
  if (values.size() <= kMostExactFlips) return values;
  VectorXd sums = VectorXd::Zero(kMostExactFlips);
  for (Index k = 0; k < values.size(); ++k) sums[k * kMostExactFlips / values.size()] += values[k];
  return sums;
}

}  // namespace

FlipResult sign_flip_test(const std::vector<FlipCandidate>& candidates, double alpha,
                          std::uint64_t seed, int flips) {
  FlipResult result;
  const std::size_t count = candidates.size();
  if (count == 0) return result;
  std::mt19937_64 engine(seed);
  const Index blocks = candidates.front().options.front().scores.rows();
  // Every option is measured against what chance makes of it.
  std::vector<Eigen::MatrixXd> null;
  for (const FlipCandidate& candidate : candidates)
    null.emplace_back(flips, static_cast<Index>(candidate.options.size()));
  for (int f = 0; f < flips; ++f) {
    const VectorXd signs = random_signs(blocks, engine);
    for (std::size_t c = 0; c < count; ++c) {
      for (std::size_t o = 0; o < candidates[c].options.size(); ++o) {
        const FlipOption& option = candidates[c].options[o];
        const VectorXd score = option.scores.transpose() * signs;
        null[c](f, static_cast<Index>(o)) = score.dot(option.inverse * score);
      }
    }
  }
  VectorXd greatest = VectorXd::Constant(flips, -1e300);
  std::vector<Chance> found;
  for (std::size_t c = 0; c < count; ++c) {
    for (Index o = 0; o < null[c].cols(); ++o) {
      const Chance chance(null[c].col(o));
      if (static_cast<std::size_t>(o) == candidates[c].found_option) found.push_back(chance);
      for (int f = 0; f < flips; ++f)
        greatest[f] = std::max(greatest[f], chance.normal(null[c](f, o)));
    }
  }
  std::sort(greatest.data(), greatest.data() + flips);
  const auto rank = static_cast<Index>(std::ceil((1.0 - alpha) * flips)) - 1;
  const double critical = greatest[std::clamp<Index>(rank, 0, flips - 1)];
  for (std::size_t c = 0; c < count; ++c) {
    const auto above = greatest.data() + flips -
                       std::lower_bound(greatest.data(), greatest.data() + flips,
                                        found[c].normal(candidates[c].gain));
    result.p_value.push_back((1.0 + static_cast<double>(above)) / (1.0 + flips));
    result.median_null.push_back(found[c].gain(0.0));
    result.critical_gain.push_back(found[c].gain(critical));
  }
  return result;
}

double sign_flip_p(const VectorXd& block_values, std::uint64_t seed, int flips) {
  if (block_values.size() < 4) return 1.0;
  std::mt19937_64 engine(seed);
  const double observed = std::abs(block_values.sum());
  int as_large = 0;
  for (int f = 0; f < flips; ++f) {
    if (std::abs(random_signs(block_values.size(), engine).dot(block_values)) >= observed)
      ++as_large;
  }
  return (1.0 + as_large) / (1.0 + flips);
}

double exact_sign_flip_p(const VectorXd& block_values) {
  const VectorXd values = few_enough(block_values);
  const Index half = values.size() / 2;
  const std::vector<double> some = sums_of_patterns(values.head(half));
  const std::vector<double> others = sums_of_patterns(values.tail(values.size() - half));
  // A pattern that only rounding parts from what was seen is as extreme.
  const double observed = std::abs(values.sum()) - 1e-12 * values.cwiseAbs().sum();
  if (observed <= 0.0) return 1.0;
  double beyond = 0.0;
  std::size_t enough = others.size();  // from here on the others' sums reach what was seen
  for (const double sum : some) {
    while (enough > 0 && sum + others[enough - 1] >= observed) --enough;
    beyond += static_cast<double>(others.size() - enough);
  }
  return 2.0 * beyond / (static_cast<double>(some.size()) * static_cast<double>(others.size()));
}

double least_exact_p(Index values) { return std::exp2(1.0 - static_cast<double>(values)); }

}  // namespace ravencal::diagnose
