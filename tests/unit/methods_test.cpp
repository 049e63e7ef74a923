// SPDX-License-Identifier: Apache-2.0
//
// Each method finds what it models, on data that was not trained on, and does not find what it
// cannot model. Bounds are shares of the error that bias removal leaves.
#include <gtest/gtest.h>

#include <cmath>

#include "core/random.hpp"
#include "methods/forest.hpp"
#include "unit/methods_sample.hpp"

namespace ravencal::test {
namespace {

using methods::Series;

/// RMSE that `id` leaves over what bias removal leaves, trained on one series, tested on another.
double share_left(std::string_view id, const SampleError& error, Eigen::Index output,
                  const methods::Settings& settings = quick_settings(),
                  const methods::Problem& problem = sample_problem()) {
  const std::vector<Series> train = {sample_series(3000, 1, error)};
  const Series test = sample_series(1500, 2, error);
  auto bias = method("bias").fit(problem, train, settings);
  auto fitted = method(id).fit(problem, train, settings);
  EXPECT_TRUE(fitted.ok()) << (fitted.ok() ? "" : fitted.error().message);
  if (!fitted.ok()) return 1e9;
  return rmse_left(**fitted, test, output) / rmse_left(**bias, test, output);
}

/// A play operator's lag: what friction behind a cable leaves. Width 0.2 rad, height 0.05 rad.
SampleError friction_error() {
  return [z = 0.0, last = 0.0](const Series& s, Eigen::Index row) mutable {
    const double q = s.inputs(row, 1);
    if (row == 0) last = q, z = 0.0;
    z = std::clamp(z + (q - last) / 0.1, -1.0, 1.0);
    last = q;
    return Eigen::Vector2d(0.1 * s.inputs(row, 0), -0.05 * z + 0.02 * q);
  };
}

Eigen::Vector2d squared_error(const Series& s, Eigen::Index row) {
  const double q = s.inputs(row, 0);
  return {0.1 * q * q + 0.05 * q * s.inputs(row, 2), 0.1 * q};
}

TEST(Methods, LinearAndRidgeFindALinearError) {
  EXPECT_LT(share_left("linear", linear_error, 0), 1e-4);
  EXPECT_LT(share_left("ridge", linear_error, 0), 1e-3);
}

TEST(Methods, LinearRegressionMissesASquareThatAPolynomialFinds) {
  EXPECT_GT(share_left("linear", squared_error, 0), 0.7);
  EXPECT_LT(share_left("polynomial", squared_error, 0), 0.01);
}

TEST(Methods, GaussianProcessFindsASmoothError) {
  const auto smooth = [](const Series& s, Eigen::Index row) {
    return Eigen::Vector2d(0.1 * std::sin(4.0 * s.inputs(row, 0)), 0.1 * s.inputs(row, 1));
  };
  EXPECT_LT(share_left("gp", smooth, 0), 0.1);
  EXPECT_GT(share_left("linear", smooth, 0), 0.3);
}

TEST(Methods, GaussianProcessCleansFailedReadingsOutOfTheTraining) {
  core::Random random(5);
  std::vector<Series> train = {sample_series(3000, 1, linear_error)};
  std::vector<Series> clean = train;
  for (Eigen::Index row = 0; row < 3000; row += 20)
    train[0].errors(row, 0) += 2.0 + random.uniform();
  const Series test = sample_series(1500, 2, linear_error);
  auto linear = method("linear").fit(sample_problem(), train, quick_settings());
  auto cleaned = method("gp").fit(sample_problem(), train, quick_settings());
  ASSERT_TRUE(cleaned.ok());
  EXPECT_GT(rmse_left(**linear, test, 0), 0.05) << "the readings must spoil who believes them";
  EXPECT_LT(rmse_left(**cleaned, test, 0), 0.02);
}

TEST(Methods, BoucWenFindsFrictionBehindACable) {
  EXPECT_LT(share_left("bouc_wen", friction_error(), 1), 0.25);
  EXPECT_GT(share_left("polynomial", friction_error(), 1), 0.6) << "no memory, no loop";
}

TEST(Methods, PhysicsFromADiagnosisFindsFrictionBehindACable) {
  methods::Settings settings = quick_settings();
  settings.physics = sample_diagnosis("methods_physics", 0.2);
  EXPECT_LT(share_left("physics", friction_error(), 1, settings), 0.35);
  EXPECT_LT(share_left("physics", friction_error(), 0, settings), 0.01);
  EXPECT_LT(share_left("physics_network", friction_error(), 1, settings), 0.3);
}

TEST(Methods, PhysicsWithAWrongWidthDoesNot) {
  methods::Settings settings = quick_settings();
  settings.physics = sample_diagnosis("methods_wrong_physics", 20.0);
  EXPECT_GT(share_left("physics", friction_error(), 1, settings), 0.6);
}

TEST(Methods, KalmanFilterFindsTheStretchThatFrictionAndWeightHold) {
  // Quasi-static stretch of a cable: friction by the direction of motion, weight by position.
  const auto stretch = [last = 0.0](const Series& s, Eigen::Index row) mutable {
    const double q = s.inputs(row, 1);
    const double speed = row == 0 ? 0.0 : (q - last) / 0.01;
    last = q;
    const double e = -0.01 * std::tanh(speed / 0.05) - 0.02 * std::cos(q);
    return Eigen::Vector2d(e, e);
  };
  EXPECT_LT(share_left("ukf", stretch, 1), 0.6);
}

TEST(Methods, RecurrentNetworksFindADelayThatOneRowCannotShow) {
  // The error is the effort as it was 30 rows ago (0.3 s); efforts are white.
  const auto delayed = [](const Series& s, Eigen::Index row) {
    const double old = row >= 35 ? s.inputs(row - 35, 2) : 0.0;
    return Eigen::Vector2d(0.1 * old, 0.1 * old);
  };
  methods::Settings settings = quick_settings();
  settings.gru_iterations = 3000;
  EXPECT_LT(share_left("gru", delayed, 0, settings), 0.5);
  EXPECT_GT(share_left("network", delayed, 0), 0.9);
}

TEST(Methods, LstmLearnsALinearError) { EXPECT_LT(share_left("lstm", linear_error, 0), 0.5); }

TEST(Methods, NetworkAndTwoPhaseFindASquare) {
  EXPECT_LT(share_left("network", squared_error, 0), 0.2);
  EXPECT_LT(share_left("two_phase", squared_error, 0), 0.4);
}

TEST(Forest, FindsAStepAndGivesTheSameTreesForTheSameSeed) {
  core::Random random(3);
  Eigen::MatrixXd x(2000, 3);
  Eigen::MatrixXd y(2000, 1);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    for (Eigen::Index c = 0; c < 3; ++c) x(i, c) = random.uniform();
    y(i, 0) = x(i, 1) > 0.4 ? 1.0 : -1.0;
  }
  const auto go_on = [](double) { return true; };
  const methods::Forest a(x, y, {.trees = 30}, go_on);
  const methods::Forest b(x, y, {.trees = 30}, go_on);
  const methods::Forest c(x, y, {.trees = 30, .seed = 4}, go_on);
  const Eigen::Vector3d low(0.5, 0.2, 0.5);
  const Eigen::Vector3d high(0.5, 0.7, 0.5);
  EXPECT_LT(a.predict(low)[0], -0.95);
  EXPECT_GT(a.predict(high)[0], 0.95);
  EXPECT_EQ(a.parameters(), b.parameters());
  double other = 0.0;
  for (double at = 0.3; at < 0.5; at += 0.005) {
    const Eigen::Vector3d near(0.5, at, 0.5);
    EXPECT_EQ(a.predict(near)[0], b.predict(near)[0]);
    other += std::abs(a.predict(near)[0] - c.predict(near)[0]);
  }
  EXPECT_GT(other, 0.0) << "another seed must give other trees";
}

}  // namespace
}  // namespace ravencal::test
