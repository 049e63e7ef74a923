// SPDX-License-Identifier: Apache-2.0
//
// Which numbers are known together only.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <random>

#include "diagnose/findings/combinations.hpp"

namespace {

using namespace ravencal;
using Eigen::Index;

TEST(Combinations, AreFoundWhereOnlyAProductIsKnown) {
  std::mt19937_64 engine(3);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd draws(400, 3);
  for (Index d = 0; d < draws.rows(); ++d) {
    const double apart = 0.5 * normal(engine);
    draws.row(d) << apart, -apart + 0.01 * normal(engine), 0.02 * normal(engine);
  }
  const auto found = diagnose::combinations_of(
      {{"compliance", "stiffness"}, {"backlash", "half_width"}, {"creep", "time"}}, draws);
  ASSERT_EQ(found.size(), 1U);
  ASSERT_EQ(found.front().parameters.size(), 2U);
  EXPECT_DOUBLE_EQ(found.front().parameters[0].power, found.front().parameters[1].power);
  EXPECT_NEAR(found.front().value, 1.0, 0.01);
  EXPECT_GT(found.front().parameters[0].relative_deviation, 0.3);
}

TEST(Combinations, AreNotFoundWhereEachParameterIsKnown) {
  std::mt19937_64 engine(4);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd draws(400, 2);
  for (Index d = 0; d < draws.rows(); ++d)
    draws.row(d) << 0.3 * normal(engine), 0.3 * normal(engine);
  EXPECT_TRUE(
      diagnose::combinations_of({{"compliance", "stiffness"}, {"creep", "time"}}, draws).empty());
}

}  // namespace
