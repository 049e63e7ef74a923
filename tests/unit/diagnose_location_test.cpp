// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <random>

#include "diagnose/selection/interval_scan.hpp"
#include "diagnose/selection/invariance.hpp"
#include "diagnose/series/posture.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kCells = 40;
constexpr Index kRowsPerCell = 50;

/// A plant of a constant and a slope along the axis, noise of one, and a mismatch added to it.
template <typename Mismatch>
ScanAxis axis_with(const Mismatch& mismatch) {
  std::mt19937_64 engine(7);
  ScanAxis axis;
  for (std::size_t c = 0; c < kCells; ++c) {
    MatrixXd rows(kRowsPerCell, 3);
    double best = 0.0;
    for (Index i = 0; i < kRowsPerCell; ++i) {
      const double x = (static_cast<double>(c) + static_cast<double>(i) / kRowsPerCell) / kCells;
      // Sum of twelve uniform numbers less six: mean 0, variance 1, the same on every platform.
      double noise = -6.0;
      for (int k = 0; k < 12; ++k) noise += static_cast<double>(engine() >> 11U) * 0x1p-53;
      rows.row(i) << 1.0, x, 3.0 - 2.0 * x + noise + mismatch(x);
      best += noise * noise;
    }
    axis.moments.emplace_back(rows.transpose() * rows);
    axis.best.push_back(best);
    axis.rows.push_back(static_cast<double>(kRowsPerCell));
  }
  return axis;
}

std::pair<std::size_t, std::size_t> scanned(const ScanAxis& axis, bool prefer_later) {
  return scan(axis, VectorXd::Zero(2), {1.0, 5.0}, prefer_later).value();
}

TEST(IntervalScan, FindsABumpThatBendsThePlantsConstant) {
  const auto [first, last] = scanned(
      axis_with([](double x) { return 5.0 * std::exp(-std::pow((x - 0.6) / 0.08, 2)); }), false);
  EXPECT_NEAR(static_cast<double>(first), 20.0, 2.0);  // 0.6 - 1.2 * 0.08 of forty
  EXPECT_NEAR(static_cast<double>(last), 27.0, 2.0);
}

TEST(IntervalScan, TakesTheLaterSideOfAStep) {
  const ScanAxis axis = axis_with([](double x) { return x > 0.71 ? 4.0 : 0.0; });
  const auto [first, last] = scanned(axis, true);
  EXPECT_NEAR(static_cast<double>(first), 28.0, 1.0);
  EXPECT_EQ(last, kCells - 1);
  const ScanAxis early = axis_with([](double x) { return x > 0.3 ? 4.0 : 0.0; });
  EXPECT_NEAR(static_cast<double>(scanned(early, true).first), 12.0, 1.0);
}

TEST(IntervalScan, SaysEverywhereWhereTheMismatchIsEverywhere) {
  const auto [first, last] =
      scanned(axis_with([](double x) { return 3.0 * std::cos(37.7 * x); }), false);
  EXPECT_EQ(first, 0U);
  EXPECT_EQ(last, kCells - 1);
}

TEST(IntervalScan, HasNothingToSayOfAnEmptyAxis) {
  EXPECT_FALSE(scan({}, VectorXd::Zero(2), {}, false).has_value());
}

TEST(Invariance, DeviationIsWhatHalvesDifferBeyondChance) {
  Invariance steady;
  steady.scales = {{"speed: low", 1.05, 0.1}, {"speed: high", 0.95, 0.1}};
  EXPECT_EQ(steady.deviation(), 0.0);
  Invariance changing = steady;
  changing.scales.push_back({"load: low", 1.3, 0.03});
  changing.scales.push_back({"load: high", 0.7, 0.04});
  // sqrt((0.6^2 - 0.05^2) / 2)
  EXPECT_NEAR(changing.deviation(), 0.4228, 1e-4);
}

/// What an encoder says of homing, gain and coupling turns the arm, recording by recording; its
/// noise does not.
TEST(Posture, TakesOverWhatIsLinearInTheBelievedPositions) {
  constexpr Eigen::Index kRows = 2000;
  std::vector<Eigen::VectorXd> believed(2, Eigen::VectorXd(kRows)), truth(2);
  truth[0].resize(kRows);
  Eigen::VectorXd exact(kRows);
  std::vector<int> recording;
  std::mt19937_64 engine(3);
  std::normal_distribution<double> noise(0.0, 5e-3);
  for (Eigen::Index i = 0; i < kRows; ++i) {
    const auto t = static_cast<double>(i);
    recording.push_back(i < 800 ? 0 : 1);
    believed[0][i] = 0.4 * std::sin(0.011 * t);
    believed[1][i] = 0.3 * std::sin(0.027 * t + 1.0);
    const double homing = i < 800 ? 0.1 : -0.05;
    exact[i] = homing + 1.05 * believed[0][i] + 0.02 * believed[1][i];
    truth[0][i] = i % 7 == 0 ? std::nan("") : exact[i] + noise(engine);
  }
  const auto posture = posture_of(believed, truth, recording);
  EXPECT_LT((posture[0] - exact).cwiseAbs().maxCoeff(), 1.5e-3) << "of noise that is 5e-3";
  EXPECT_EQ((posture[1] - believed[1]).cwiseAbs().maxCoeff(), 0.0) << "has no encoder";
}

}  // namespace
}  // namespace ravencal::diagnose
