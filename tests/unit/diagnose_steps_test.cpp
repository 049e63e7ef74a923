// SPDX-License-Identifier: Apache-2.0
//
// Steps against noise that remembers, and least squares within limits.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "diagnose/fit/block_fit.hpp"
#include "diagnose/selection/step.hpp"

namespace {

using namespace ravencal;
using Eigen::Index;

/// A channel of `rows` samples without a start but the first.
diagnose::Series plain_series(Index rows) {
  diagnose::Series s;
  s.y = Eigen::VectorXd::Zero(rows);
  s.t_s = Eigen::VectorXd::LinSpaced(rows, 0.0, 0.02 * static_cast<double>(rows - 1));
  s.fresh.assign(static_cast<std::size_t>(rows), 0);
  s.fresh.front() = 1;
  return s;
}

diagnose::Blocks all_rows(Index rows) {
  diagnose::Blocks blocks;
  for (Index i = 0; i < rows; ++i) blocks.rows.push_back(i);
  blocks.begin = {0, rows};
  blocks.fold = {0};
  return blocks;
}

/// Noise that forgets with `memory` rows, of unit deviation.
Eigen::VectorXd remembering(Index rows, double memory, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  const auto draw = [&engine] {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += static_cast<double>(engine() >> 11U) * 0x1.0p-53;
    return sum;
  };
  const double keep = std::exp(-1.0 / memory);
  Eigen::VectorXd x(rows);
  double state = draw();
  for (Index i = 0; i < rows; ++i)
    x[i] = state = keep * state + std::sqrt(1 - keep * keep) * draw();
  return x;
}

TEST(SolveWithin, IsTheLeastErrorInTheBox) {
  // Two columns that nearly imitate each other and one that neither can.
  const Index rows = 400;
  Eigen::MatrixXd x(rows, 3);
  x.col(0) = remembering(rows, 5.0, 1);
  x.col(1) = 0.9 * x.col(0) + 0.2 * remembering(rows, 5.0, 2);
  x.col(2) = remembering(rows, 5.0, 3);
  const Eigen::VectorXd y = 1.0 * x.col(0) + 0.3 * x.col(1) - 0.2 * x.col(2);
  Eigen::MatrixXd total(4, 4);
  total << x.transpose() * x, x.transpose() * y, y.transpose() * x, y.squaredNorm();
  const Eigen::Vector3d precision(0.0, 20.0, 20.0), limit(0.6, 1.0, 1.0);
  const auto error = [&](const Eigen::Vector3d& b) {
    return (y - x * b).squaredNorm() + b.cwiseAbs2().dot(precision);
  };
  const Eigen::Vector3d b = diagnose::solve_within(total, precision, limit);
  EXPECT_DOUBLE_EQ(b[0], 0.6);
  EXPECT_LT(std::abs(b[1]), 1.0);  // released again, or never held
  for (Index i = 0; i < 3; ++i) {
    for (const double move : {-1e-3, 1e-3}) {
      Eigen::Vector3d other = b;
      other[i] = std::clamp(b[i] + move, -limit[i], limit[i]);
      EXPECT_GE(error(other), error(b) - 1e-9) << i;
    }
  }
}

TEST(Steps, AreNotFoundInNoiseThatRemembers) {
  // So long a memory leaves some ten moments that are independent of each other.
  const Index rows = 4000;
  const diagnose::Series s = plain_series(rows);
  int alarms = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const auto noise = remembering(rows, 40.0, seed);
    alarms += diagnose::find_steps(s, all_rows(rows), noise, 80.0).empty() ? 0 : 1;
  }
  // One is expected of 200 at 0.5 %; beyond five is one in a thousand.
  EXPECT_LE(alarms, 5);
}

TEST(Steps, OfFourTimesTheNoiseAreFound) {
  const Index rows = 10000;
  const diagnose::Series s = plain_series(rows);
  auto noise = remembering(rows, 10.0, 7);
  noise.tail(4000).array() += 4.0;
  const auto steps = diagnose::find_steps(s, all_rows(rows), noise, 20.0);
  ASSERT_EQ(steps.size(), 1U);
  EXPECT_NEAR(static_cast<double>(steps.front().row), 6000.0, 40.0);
  EXPECT_NEAR(steps.front().size, 4.0, 1.0);
  EXPECT_LT(steps.front().p_value, 0.005);
}

}  // namespace
