// SPDX-License-Identifier: Apache-2.0
#include "core/median.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <vector>

namespace {

using namespace ravencal;

TEST(Median, IsTheUpperOfTwoInTheMiddle) {
  EXPECT_EQ(core::upper_median(std::vector<double>{3.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(core::upper_median(std::vector<double>{4.0, 3.0, 1.0, 2.0}), 3.0);
  EXPECT_EQ(core::upper_median(std::vector<double>{}), 0.0);
}

TEST(Median, IsTheQuantileOfOneHalf) {
  std::vector<int> values;
  for (int n = 1; n <= 200; ++n) {
    values.push_back((37 * n) % 199);
    EXPECT_EQ(core::upper_quantile(values, 0.5), core::upper_median(values)) << n;
    EXPECT_EQ(core::upper_quantile(values, 1.0), *std::max_element(values.begin(), values.end()));
  }
}

TEST(Median, ScaleIsThatOfTheNormalWhateverTheOutliers) {
  const Eigen::VectorXd x = (Eigen::VectorXd(7) << -1.0, 1.0, 1e9, -1.0, 1.0, 1.0, -1e9).finished();
  EXPECT_DOUBLE_EQ(core::normal_deviation(x), core::kNormalPerMad);
  const Eigen::VectorXd moved = x.array() + 5.0;
  EXPECT_DOUBLE_EQ(core::normal_deviation(moved, 5.0), core::kNormalPerMad);
}

}  // namespace
