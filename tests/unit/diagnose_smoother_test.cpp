// SPDX-License-Identifier: Apache-2.0
//
// How long the window is over which a drive's motion and effort are averaged.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "diagnose/series/smoother.hpp"

namespace {

using namespace ravencal;
using Eigen::Index;
using Eigen::VectorXd;

/// Slow motion under coarse counts asks for a long window; friction that turns within a tenth of a
/// second must outlive it where the inertia is too small for the accelerations to matter.
TEST(SmoothMotion, KeepsTheEffortThatItIsComparedWith) {
  const Index rows = 20000;
  const VectorXd t_s = VectorXd::LinSpaced(rows, 0.0, 0.01 * static_cast<double>(rows - 1));
  VectorXd q(rows), effort(rows);
  double side = 0.0;
  for (Index i = 0; i < rows; ++i) {
    q[i] = 1e-3 * std::round(1e3 * 0.5 * std::sin(0.6 * t_s[i]));
    side +=
        0.1 * (std::copysign(1.0, std::cos(0.6 * t_s[i]) + 0.7 * std::cos(9.0 * t_s[i])) - side);
    effort[i] = side;
  }
  const std::vector<char> none(static_cast<std::size_t>(rows), 0);
  const auto power_kept = [&](double half_width_s) {
    return diagnose::filter_like_acceleration(t_s, effort, none, half_width_s).squaredNorm() /
           effort.squaredNorm();
  };
  const double alone_s = diagnose::smooth_motion(t_s, q, none, none, 2).half_width_s;
  EXPECT_LT(power_kept(alone_s), 0.8);
  const diagnose::Driven light{effort, 1e-6};
  EXPECT_GT(power_kept(diagnose::smooth_motion(t_s, q, none, none, 2, &light).half_width_s), 0.85);
  // Where the inertia makes an effort of the counts, the window stays.
  const diagnose::Driven heavy{effort, 1e3};
  EXPECT_EQ(diagnose::smooth_motion(t_s, q, none, none, 2, &heavy).half_width_s, alone_s);
}

}  // namespace
