// SPDX-License-Identifier: Apache-2.0
#include "choice/expected.hpp"

#include <algorithm>
#include <cmath>

#include "choice/trial.hpp"
#include "core/students_t.hpp"

namespace ravencal::choice {
namespace {

/// RMSE below this one, SI, are rounding: a nanoradian or a nanometre.
constexpr double kLeastRmse = 1e-9;

/// Standard deviations of a normal variable that 97.5 % lie below.
constexpr double kNormal975 = 1.96;

double mean_square(const Eigen::ArrayXd& values) {
  return std::max(values.square().mean(), kLeastRmse * kLeastRmse);
}

}  // namespace

model::ExpectedError expected_error(const std::vector<Eigen::VectorXd>& judged,
                                    const std::vector<double>& homing_constants,
                                    double left_to_chance) {
  std::vector<double> squares;
  std::vector<double> about_mean;
  std::vector<double> logs;
  for (const Eigen::VectorXd& list : judged) {
    squares.push_back(mean_square(list.array()));
    about_mean.push_back(mean_square(list.array() - list.mean()));
    logs.push_back(0.5 * std::log(squares.back()));
  }
  const double median = std::exp(mean_of(logs));
  const double factor = std::exp(core::one_more(logs).half95);
  model::ExpectedError expected;
  expected.same_homing = {std::sqrt(mean_of(squares)), median / factor,
                          std::hypot(median * factor, kNormal975 * left_to_chance)};
  expected.about_mean = std::sqrt(mean_of(about_mean));
  if (homing_constants.size() > 1) {
    const auto& [rmse, low, high] = expected.same_homing;
    const core::OneMore constant = core::one_more(homing_constants);
    expected.other_homing = {std::hypot(rmse, constant.deviation), low,
                             std::hypot(high, constant.half95)};
  }
  return expected;
}

}  // namespace ravencal::choice
