// SPDX-License-Identifier: Apache-2.0
//
// Means over the travel of a position, as FeatureState makes them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "model/feature_state.hpp"

namespace ravencal::model {
namespace {

constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();
constexpr float kEndless = std::numeric_limits<float>::infinity();

/// Mean of source 0 over the travel of source 1.
FeatureOp travel_mean(float travel, Transform transform = Transform::kTravelMean) {
  FeatureOp op;
  op.transform = transform;
  op.travel = travel;
  op.along = 1;
  return op;
}

/// A feature state over a channel and a position, with memory of exactly the size that it asks for.
struct TravelMachine {
  explicit TravelMachine(std::vector<FeatureOp> the_ops)
      : ops(std::move(the_ops)),
        memory(FeatureState::memory_floats(ops, 2)),
        state(ops, 2, memory),
        features(ops.size()) {}

  [[gnu::noinline]] const std::vector<float>& advance(float x, float position) {
    const std::array<float, 2> sources = {x, position};
    state.advance(sources, features);
    return features;
  }

  std::vector<FeatureOp> ops;
  std::vector<float> memory;
  FeatureState state;
  std::vector<float> features;
};

TEST(TravelMean, OfASweepIsTheClosedFormAtEveryRate) {
  constexpr double kTravel = 0.5;
  constexpr double kSpeedPerS = 0.25;
  constexpr double kSlack = kTravel * static_cast<double>(kTravelDeadband);
  for (const int ticks_per_s : {1000, 100}) {
    const double step = kSpeedPerS / ticks_per_s;
    TravelMachine machine({travel_mean(static_cast<float>(kTravel))});
    EXPECT_EQ(machine.advance(2.0F, 0.0F)[0], 2.0F);  // starts at the first value
    for (int tick = 1; tick <= 8 * ticks_per_s; ++tick) {
      const double position = step * tick;
      const auto now = static_cast<double>(machine.advance(5.0F, static_cast<float>(position))[0]);
      const double travelled = std::max(0.0, position - kSlack);
      const double steps = travelled / step;
      const double implicit = 5.0 - 3.0 * std::pow(1.0 + step / kTravel, -steps);
      const double exponential = 5.0 - 3.0 * std::exp(-travelled / kTravel);
      // A step of which a part is slack is one smaller step.
      ASSERT_NEAR(now, implicit, step * step / kTravel + 2e-6)
          << ticks_per_s << " Hz, tick " << tick;
      ASSERT_NEAR(now, exponential, step / kTravel) << ticks_per_s << " Hz, tick " << tick;
    }
  }
}

TEST(TravelMean, IsTheSameAtEverySpeedAndInBothDirections) {
  TravelMachine slow({travel_mean(0.1F)});
  TravelMachine fast({travel_mean(0.1F)});
  slow.advance(1.0F, 0.0F);
  fast.advance(1.0F, 0.0F);
  for (int step = 1; step <= 300; ++step) {
    const float position = (1.0F / 1024.0F) * static_cast<float>(step <= 150 ? step : 300 - step);
    for (int tick = 0; tick < 9; ++tick) slow.advance(3.0F, position);  // waits there
    ASSERT_EQ(slow.advance(3.0F, position), fast.advance(3.0F, position)) << step;
  }
  EXPECT_NEAR(fast.features[0], 3.0 - 2.0 * std::exp(-3.0), 2e-2) << "ways to and fro add up";
}

TEST(TravelMean, StandsStillWithinTheDeadBand) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> noise(-1.0F, 1.0F);
  constexpr float kTravel = 0.2F;
  TravelMachine machine({travel_mean(kTravel), travel_mean(kTravel, Transform::kTravelMeanOfAbs)});
  machine.advance(-1.0F, 0.0F);
  for (int t = 0; t < 1000; ++t) machine.advance(-2.0F, 1e-3F * static_cast<float>(t));
  const std::vector<float> before = machine.features;
  // The follower lies half a band behind; noise around the middle of its band does not push it.
  const float middle = 0.999F - kTravelDeadband * kTravel;
  for (int t = 0; t < 10'000; ++t) {
    const float position = middle + 0.99F * kTravelDeadband * kTravel * noise(random);
    ASSERT_EQ(machine.advance(100.0F * noise(random), position), before) << t;
  }
  machine.advance(50.0F, middle + kTravel);
  EXPECT_GT(machine.features[0], before[0] + 1.0F);
}

TEST(TravelMean, OfAbsForgetsTheSign) {
  TravelMachine signs({travel_mean(0.1F, Transform::kTravelMeanOfAbs)});
  TravelMachine sizes({travel_mean(0.1F)});
  for (int t = 0; t < 200; ++t) {
    const auto x = static_cast<float>(std::sin(0.7 * t));
    const auto position = static_cast<float>(std::sin(0.1 * t));
    EXPECT_EQ(signs.advance(x, position), sizes.advance(std::abs(x), position));
  }
}

TEST(TravelMean, ALostValueDoesNotDisturbIt) {
  const std::vector<FeatureOp> ops = {travel_mean(0.3F),
                                      travel_mean(0.3F, Transform::kTravelMeanOfAbs)};
  TravelMachine disturbed(ops);
  TravelMachine whole(ops);
  EXPECT_TRUE(std::isnan(disturbed.advance(kNoNumber, 0.0F)[1]));
  for (int t = 0; t < 100; ++t) {
    const auto x = static_cast<float>(std::cos(0.7 * t));
    const auto position = static_cast<float>(std::sin(0.2 * t));
    EXPECT_EQ(disturbed.advance(x, position), whole.advance(x, position)) << t;
    for (const float lost : {kNoNumber, kEndless, -kEndless}) {
      for (const float seen : disturbed.advance(lost, position)) EXPECT_FALSE(std::isfinite(seen));
      EXPECT_EQ(disturbed.advance(-4.0F, lost), whole.features) << "no position, no travel";
    }
  }
}

TEST(TravelMean, StartsAtItsFirstValueWhereverThePositionIs) {
  TravelMachine machine({travel_mean(0.1F)});
  EXPECT_EQ(machine.advance(2.0F, kNoNumber)[0], 2.0F);
  EXPECT_EQ(machine.advance(3.0F, 7.0F)[0], 2.0F) << "the first position is no travel";
  EXPECT_GT(machine.advance(3.0F, 7.1F)[0], 2.1F);
  machine.state.reset();
  EXPECT_EQ(machine.advance(4.0F, -7.0F)[0], 4.0F);
  EXPECT_EQ(machine.advance(5.0F, -7.0F)[0], 4.0F);
}

TEST(TravelMean, AJumpBeyondTheRangeOfAFloatIsAFullStep) {
  constexpr float kFar = std::numeric_limits<float>::max();
  for (const float travel : {1e-6F, 1.0F, 1000.0F}) {
    TravelMachine machine({travel_mean(travel)});
    machine.advance(2.0F, kFar);
    EXPECT_EQ(machine.advance(3.0F, -kFar)[0], 3.0F) << travel;
    EXPECT_EQ(machine.advance(-5.0F, kFar)[0], -5.0F) << travel;
    EXPECT_EQ(machine.advance(7.0F, kFar)[0], -5.0F) << travel;
  }
}

TEST(TravelMean, ReachesAConstantInputHoweverSmallItsSteps) {
  TravelMachine machine({travel_mean(1000.0F)});
  machine.advance(1000.0F, 0.0F);
  float position = 0.0F;
  // Every step of the mean is far below the last digit of its state.
  for (int tick = 0; tick < 4'000'000; ++tick) {
    position = position == 0.0F ? 32.0F : 0.0F;
    machine.advance(tick < 100 ? 1000.0F : 1000.01F, position);
  }
  EXPECT_NEAR(machine.features[0], 1000.01F, 1e-3F);
}

TEST(TravelMean, NeedsAThirdStateOfEveryInput) {
  const std::array<FeatureOp, 2> ops = {FeatureOp{}, travel_mean(0.1F)};
  EXPECT_EQ(FeatureState::memory_floats(ops, 2), 3U * 2U);
  FeatureOp lag;
  lag.transform = Transform::kLag;
  lag.lag_ticks = 4;
  const std::array<FeatureOp, 2> lagged = {lag, travel_mean(0.1F)};
  EXPECT_EQ(FeatureState::memory_floats(lagged, 2), 3U * 2U + 5U * 2U);
}

}  // namespace
}  // namespace ravencal::model
