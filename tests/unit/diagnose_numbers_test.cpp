// SPDX-License-Identifier: Apache-2.0
//
// Which numbers are known together only.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

#include "diagnose/findings/combinations.hpp"

namespace {

using namespace ravencal;

TEST(Combinations, AreFoundWhereOnlyAProductIsKnown) {
  Eigen::Matrix3d covariance = Eigen::Vector3d(0.25, 0.25, 4e-4).asDiagonal();
  covariance(0, 1) = covariance(1, 0) = -0.25 + 5e-5;
  const auto found = diagnose::combination_of(
      {{"compliance", "stiffness"}, {"backlash", "half_width"}, {"creep", "time"}},
      Eigen::Vector3d(1.0, -1.0, 0.5), covariance);
  ASSERT_TRUE(found.has_value());
  ASSERT_EQ(found->parameters.size(), 2U);
  EXPECT_DOUBLE_EQ(found->parameters[0].power, found->parameters[1].power);
  EXPECT_NEAR(found->value, 1.0, 1e-6);
  EXPECT_NEAR(found->ci95.second, std::exp(0.0196), 1e-6);
  EXPECT_NEAR(found->parameters[0].relative_deviation, 0.5, 1e-9);
}

TEST(Combinations, AreNotFoundWhereEachParameterIsKnown) {
  const Eigen::Matrix2d covariance = 0.09 * Eigen::Matrix2d::Identity();
  EXPECT_FALSE(diagnose::combination_of({{"compliance", "stiffness"}, {"creep", "time"}},
                                        Eigen::Vector2d::Zero(), covariance));
}

}  // namespace
