// SPDX-License-Identifier: Apache-2.0
//
// Two levels in what a law leaves of the recorded command, and what they are not.
#include "diagnose/model/pulses.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// A minute to and fro at 50 Hz, and what is left: a function of time, position and velocity.
struct Scene {
  std::vector<Track> tracks{1};
  std::vector<VectorXd> left{VectorXd(3000)};

  explicit Scene(const std::function<double(double t_s, double q, double v)>& made) {
    Track& track = tracks[0];
    track.period_s = 0.02;
    track.forced.t_s = VectorXd::LinSpaced(3000, 0.0, 59.98);
    track.forced.fresh.assign(3000, 0);
    track.lost = {std::vector<char>(3000, 0)};
    physics::Motion motion{VectorXd(3000), VectorXd(3000), VectorXd::Zero(3000), 0.0};
    std::mt19937 random(3);
    std::normal_distribution<double> noise(0.0, 0.1);
    for (Index i = 0; i < 3000; ++i) {
      const double t_s = track.forced.t_s[i];
      motion.q[i] = std::sin(t_s);
      motion.v[i] = std::cos(t_s);
      left[0][i] = made(t_s, motion.q[i], motion.v[i]) + noise(random);
    }
    track.forced.motors = {std::move(motion)};
  }

  [[nodiscard]] std::optional<Pulses> found() const { return pulses_in(tracks, 0, left); }
};

double pulses_of_7_s(double t_s, double, double) { return std::fmod(t_s, 7.0) >= 5.5 ? -2.0 : 0.0; }

TEST(Pulses, AreFoundWithSizeAndMoments) {
  const auto found = Scene(pulses_of_7_s).found();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->size, -2.0, 0.05);
  ASSERT_EQ(found->on_s[0].size(), 8U);
  for (std::size_t k = 0; k < 8; ++k) {
    EXPECT_NEAR(found->on_s[0][k].first, 7.0 * static_cast<double>(k) + 5.5, 0.02);
    EXPECT_NEAR(found->on_s[0][k].second, 7.0 * static_cast<double>(k) + 7.0, 0.02);
  }
}

TEST(Pulses, AreOnForTheirShareOfARow) {
  const Scene scene(pulses_of_7_s);
  const VectorXd share = share_on(scene.tracks[0], {{0.995, 1.03}});
  EXPECT_NEAR(share[49], 0.0, 1e-12);
  EXPECT_NEAR(share[50], 0.75, 1e-9);
  EXPECT_NEAR(share[51], 1.0, 1e-9);
  EXPECT_NEAR(share.sum() * 0.02, 0.035, 1e-9);
}

/// Those at the ends are cut there, and lost rows part two.
TEST(Pulses, EndWhereNothingWasRecorded) {
  Scene scene([](double t_s, double, double) { return t_s > 50.0 || t_s < 5.0 ? 2.0 : 0.0; });
  for (std::size_t i = 2700; i < 2750; ++i) scene.tracks[0].lost[0][i] = 1;
  const auto found = scene.found();
  ASSERT_TRUE(found);
  ASSERT_EQ(found->on_s[0].size(), 3U);
  EXPECT_EQ(found->on_s[0][0].first, 0.0);
  EXPECT_NEAR(found->on_s[0][1].second, 53.98, 1e-9);
  EXPECT_NEAR(found->on_s[0][2].first, 55.0, 1e-9);
  EXPECT_NEAR(found->on_s[0][2].second, 59.98, 1e-9);
}

TEST(Pulses, AreNotNoiseNorDriftNorWhatMotionSays) {
  EXPECT_FALSE(Scene([](double, double, double) { return 0.0; }).found());
  EXPECT_FALSE(Scene([](double t_s, double, double) { return 0.1 * t_s; }).found());
  EXPECT_FALSE(Scene([](double, double, double v) { return v > 0.0 ? 2.0 : -2.0; }).found());
  EXPECT_FALSE(Scene([](double, double q, double) { return q > 0.3 ? 2.0 : 0.0; }).found());
}

}  // namespace
}  // namespace ravencal::diagnose
