// SPDX-License-Identifier: Apache-2.0
//
// Hard stops told from turns, pauses elsewhere and bounces.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "quadrature_reader/homing.hpp"

namespace ravencal::quadrature_reader {
namespace {

constexpr double kHz = 250.0;

/// Counts at kHz, rounded as an encoder does, with a little vibration.
class Motion {
 public:
  explicit Motion(unsigned seed, double vibration_counts = 1.0)
      : generator_(seed), vibration_(0.0, vibration_counts) {}

  Motion& move_to(double target, double counts_per_s) {
    const double step = (target > position_ ? 1.0 : -1.0) * counts_per_s / kHz;
    while (std::abs(target - position_) > std::abs(step)) put(position_ + step);
    put(target);
    return *this;
  }
  Motion& rest(double seconds) {
    for (int i = 0; i < static_cast<int>(kHz * seconds); ++i) put(position_);
    return *this;
  }
  Motion& swing(double amplitude, double hz, double seconds) {
    const double centre = position_ - amplitude;
    for (int i = 0; i < static_cast<int>(kHz * seconds); ++i) {
      put(centre + amplitude * std::cos(2.0 * M_PI * hz * i / kHz));
    }
    return *this;
  }
  Motion& bounce(double height, double seconds) {
    const double floor = position_;
    for (int i = 0; i < static_cast<int>(kHz * seconds); ++i) {
      put(floor - height * std::exp(-i / 7.5) * std::cos(0.4 * i));
    }
    put(floor);
    return *this;
  }

  /// Pressed against a stop that yields: `yield_counts` further until `seconds` are over.
  Motion& press(double yield_counts, double seconds) {
    const double from = position_;
    const int samples = static_cast<int>(kHz * seconds);
    for (int i = 1; i <= samples; ++i) put(from + yield_counts * i / samples);
    return *this;
  }
  /// As the controller leaves the stop: half a cosine.
  Motion& blend_to(double target, double seconds) {
    const double from = position_;
    const int samples = static_cast<int>(kHz * seconds);
    for (int i = 1; i <= samples; ++i)
      put(from + 0.5 * (1.0 - std::cos(M_PI * i / samples)) * (target - from));
    return *this;
  }

  [[nodiscard]] std::optional<HardStop> stop(bool at_maximum) const {
    return find_hard_stop(t_ns_, counts_, at_maximum);
  }

 private:
  void put(double position) {
    position_ = position;
    t_ns_.push_back(static_cast<std::int64_t>(t_ns_.size()) * 4'000'000);
    counts_.push_back(std::round(position + vibration_(generator_)));
  }

  std::mt19937 generator_;
  std::normal_distribution<double> vibration_;
  double position_ = 0.0;
  std::vector<std::int64_t> t_ns_;
  std::vector<double> counts_;
};

TEST(HardStop, IsFoundToACountAsTheRobotHomes) {
  // RAVEN-II: 10 deg/s = 2222 counts/s onto the stop, 0.4 s there, then home; homing takes seconds.
  for (unsigned seed = 0; seed < 20; ++seed) {
    const auto stop = Motion(seed)
                          .rest(5.0)
                          .move_to(-6000, 2222)
                          .rest(0.4)
                          .move_to(1000, 1500)
                          .rest(10.0)
                          .stop(false);
    ASSERT_TRUE(stop) << seed;
    EXPECT_NEAR(stop->position_counts, -6000.0, 1.5) << seed;
    EXPECT_GT(stop->confidence, 0.999);
    EXPECT_LT(stop->spread_counts, 4.0);
  }
}

TEST(HardStop, IsFoundWhereTheJointIsPressedFor200MillisecondsOnly) {
  // RAVEN-II's insertion: 20 mm/s = 4000 counts/s, then until the current is reached, 0.2 s, away.
  for (unsigned seed = 0; seed < 50; ++seed) {
    const auto stop = Motion(seed)
                          .rest(1.0)
                          .move_to(35'000, 4000)
                          .press(40.0, 0.2)
                          .press(-30.0, 0.2)
                          .blend_to(2000, 2.5)
                          .rest(5.0)
                          .stop(true);
    ASSERT_TRUE(stop) << seed;
    EXPECT_NEAR(stop->position_counts, 35'020.0, 25.0) << seed << ": within what the stop yields";
    EXPECT_GT(stop->spread_counts, 5.0) << "and says so";
  }
}

TEST(HardStop, IsFoundBehindABounce) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const auto stop =
        Motion(seed).move_to(-8000, 2222).bounce(15.0, 0.3).rest(1.0).move_to(0, 1500).stop(false);
    ASSERT_TRUE(stop) << seed;
    EXPECT_NEAR(stop->position_counts, -8000.0, 2.0) << seed;
  }
}

TEST(HardStop, IsNotConfusedByALongRestCloseBy) {
  const auto stop =
      Motion(1).rest(60.0).move_to(-667, 1000).rest(0.5).move_to(3000, 1000).rest(60.0).stop(false);
  ASSERT_TRUE(stop);
  EXPECT_NEAR(stop->position_counts, -667.0, 2.0);
}

TEST(HardStop, IsNotSeenInASmoothTurn) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    for (const double hz : {0.02, 0.1, 0.5}) {
      EXPECT_FALSE(Motion(seed).swing(5000.0, hz, 60.0).stop(true)) << seed << " " << hz;
    }
  }
}

TEST(HardStop, IsNotSeenInAZigZag) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    EXPECT_FALSE(Motion(seed).move_to(5000, 2000).move_to(-5000, 2000).move_to(0, 2000).stop(true))
        << seed;
  }
}

TEST(HardStop, IsNotSeenWhereTheJointHasBeenFromTheStart) {
  EXPECT_FALSE(Motion(1).rest(10.0).stop(true));
  EXPECT_FALSE(Motion(1).rest(10.0).move_to(-5000, 2000).stop(true)) << "nobody drove it there";
}

TEST(HardStop, NeedsData) { EXPECT_FALSE(find_hard_stop({}, {}, true)); }

}  // namespace
}  // namespace ravencal::quadrature_reader
