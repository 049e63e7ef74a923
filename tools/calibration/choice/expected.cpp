// SPDX-License-Identifier: Apache-2.0
#include "choice/expected.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "choice/trial.hpp"
#include "core/students_t.hpp"

namespace ravencal::choice {
namespace {

/// Of one more value beside `values`: half of its 95 % interval, 0 if there are fewer than two.
double half_interval(const std::vector<double>& values) {
  if (values.size() < 2) return 0.0;
  const auto n = static_cast<double>(values.size());
  return core::students_t_975(n - 1.0) * standard_error(values) * std::sqrt(n + 1.0);
}

double mean_square(const Eigen::ArrayXd& values) {
  return std::max(values.square().mean(), std::numeric_limits<double>::min());
}

}  // namespace

model::ExpectedError expected_error(const std::vector<Eigen::VectorXd>& judged,
                                    const std::vector<double>& session_constants) {
  std::vector<double> squares;
  std::vector<double> about_mean;
  std::vector<double> logs;
  for (const Eigen::VectorXd& list : judged) {
    squares.push_back(mean_square(list.array()));
    about_mean.push_back(mean_square(list.array() - list.mean()));
    logs.push_back(0.5 * std::log(squares.back()));
  }
  const double median = std::exp(mean_of(logs));
  const double factor = std::exp(half_interval(logs));
  // A constant's half interval over Student's quantile is its standard deviation.
  const double constant = half_interval(session_constants);
  const double degrees = std::max(1.0, static_cast<double>(session_constants.size()) - 1.0);
  return {std::hypot(std::sqrt(mean_of(squares)), constant / core::students_t_975(degrees)),
          median / factor, std::hypot(median * factor, constant), std::sqrt(mean_of(about_mean))};
}

}  // namespace ravencal::choice
