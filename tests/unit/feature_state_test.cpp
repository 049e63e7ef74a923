// SPDX-License-Identifier: Apache-2.0
#include "model/feature_state.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "model/mean_gain.hpp"

namespace ravencal::model {
namespace {

FeatureOp value(std::uint32_t source = 0) { return {source, Transform::kValue, 0, 0.0F}; }
FeatureOp lag(std::uint32_t ticks, std::uint32_t source = 0) {
  return {source, Transform::kLag, ticks, 0.0F};
}
FeatureOp play(float half_width) { return {0, Transform::kPlay, 0, half_width}; }
FeatureOp mean(double tick_s, double time_constant_s, Transform transform = Transform::kMean) {
  return {0, transform, 0, 0.0F, mean_gain(tick_s, time_constant_s)};
}

/// A feature state with memory of exactly the size that it asks for.
struct Machine {
  explicit Machine(std::vector<FeatureOp> the_ops, std::size_t sources = 1)
      : ops(std::move(the_ops)),
        memory(FeatureState::memory_floats(ops, sources)),
        state(ops, sources, memory),
        features(ops.size()) {}

  // Not inlined: gcc 12 otherwise sees writes beyond a ring that it takes for empty.
  [[gnu::noinline]] const std::vector<float>& advance(const std::vector<float>& sources) {
    state.advance(sources, features);
    return features;
  }

  std::vector<FeatureOp> ops;
  std::vector<float> memory;
  FeatureState state;
  std::vector<float> features;
};

TEST(FeatureState, PassesPlainValuesOn) {
  Machine machine({value(1), value(0)}, 2);
  EXPECT_EQ(machine.advance({3.0F, 4.0F}), (std::vector<float>{4.0F, 3.0F}));
}

TEST(FeatureState, ALagReturnsTheValueOfThatManyTicksAgo) {
  Machine machine({lag(3), lag(1)});
  for (int t = 0; t < 50; ++t) {
    const auto& features = machine.advance({static_cast<float>(t)});
    if (t >= 3) {
      EXPECT_EQ(features[0], static_cast<float>(t - 3));
      EXPECT_EQ(features[1], static_cast<float>(t - 1));
    }
  }
}

TEST(FeatureState, ALagBeforeEnoughHistoryReturnsTheOldestValueKnown) {
  Machine machine({lag(3)});
  EXPECT_EQ(machine.advance({10.0F})[0], 10.0F);
  EXPECT_EQ(machine.advance({11.0F})[0], 10.0F);
  EXPECT_EQ(machine.advance({12.0F})[0], 10.0F);
  EXPECT_EQ(machine.advance({13.0F})[0], 10.0F);
  EXPECT_EQ(machine.advance({14.0F})[0], 11.0F);
}

TEST(FeatureState, ResetForgetsThePast) {
  Machine machine({lag(2), play(1.0F), mean(0.01, 1.0)});
  for (int t = 0; t < 7; ++t) machine.advance({static_cast<float>(t)});
  machine.state.reset();
  EXPECT_EQ(machine.advance({100.0F}), (std::vector<float>{100.0F, 100.0F, 100.0F}));
}

TEST(FeatureState, PlayStartsAtTheFirstValueAndFollowsAtItsHalfWidth) {
  Machine machine({play(1.0F)});
  EXPECT_EQ(machine.advance({5.0F})[0], 5.0F);
  EXPECT_EQ(machine.advance({5.9F})[0], 5.0F);  // inside the slack
  EXPECT_EQ(machine.advance({8.0F})[0], 7.0F);  // dragged upwards
  EXPECT_EQ(machine.advance({6.5F})[0], 7.0F);  // reversal: slack again
  EXPECT_EQ(machine.advance({4.0F})[0], 5.0F);  // dragged downwards
}

TEST(FeatureState, PlayNeverLeavesItsBandAndOnlyMovesAtItsEdge) {
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  constexpr float kHalfWidth = 0.5F;
  Machine machine({play(kHalfWidth)});
  float x = 0.0F;
  float before = machine.advance({x})[0];
  for (int t = 0; t < 10'000; ++t) {
    x += 0.2F * normal(random);
    const float now = machine.advance({x})[0];
    EXPECT_LE(std::abs(x - now), kHalfWidth * 1.0001F);
    if (now != before) {
      EXPECT_NEAR(std::abs(x - now), kHalfWidth, 1e-5);
    }
    before = now;
  }
}

TEST(FeatureState, ANotANumberPassesThroughAndDoesNotStick) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  Machine machine({value(), play(1.0F)});
  machine.advance({kNan});
  machine.advance({2.0F});
  const auto bad = machine.advance({kNan});
  EXPECT_TRUE(std::isnan(bad[0]));
  EXPECT_TRUE(std::isnan(bad[1]));
  EXPECT_EQ(machine.advance({2.5F}), (std::vector<float>{2.5F, 2.0F}));
}

TEST(FeatureState, AtTenTimesTheRateALagOfTenTimesTheTicksSeesTheSame) {
  Machine rows({lag(4)});
  Machine ticks({lag(40)});
  for (int row = 0; row < 100; ++row) {
    const auto x = static_cast<float>(std::sin(0.3 * row));
    const float at_row = rows.advance({x})[0];
    float at_tick = ticks.advance({x})[0];
    if (row >= 4) {
      EXPECT_EQ(at_row, at_tick);
    }
    for (int i = 1; i < 10; ++i) at_tick = ticks.advance({x})[0];
  }
}

TEST(MeanGain, IsTheShareOfAnExponential) {
  EXPECT_FLOAT_EQ(mean_gain(0.01, 0.5), static_cast<float>(1.0 - std::exp(-0.02)));
  EXPECT_FLOAT_EQ(mean_gain(0.001, 1000.0), 1e-6F);
  EXPECT_EQ(mean_gain(60.0, 0.001), 1.0F);
}

TEST(FeatureState, AMeanAnswersToAStepAsTheClosedFormAtEveryRate) {
  constexpr double kTimeConstantS = 0.5;
  for (const int ticks_per_s : {1000, 100}) {
    const double tick_s = 1.0 / ticks_per_s;
    Machine machine({mean(tick_s, kTimeConstantS)});
    EXPECT_EQ(machine.advance({2.0F})[0], 2.0F);  // starts at the first value
    for (int tick = 1; tick <= 3 * ticks_per_s; ++tick) {
      const auto now = static_cast<double>(machine.advance({5.0F})[0]);
      const double expected = 5.0 - 3.0 * std::exp(-tick * tick_s / kTimeConstantS);
      ASSERT_NEAR(now, expected, 2e-6) << ticks_per_s << " Hz, tick " << tick;
    }
  }
}

TEST(FeatureState, AMeanOfAbsForgetsTheSign) {
  const FeatureOp of_abs = mean(0.01, 0.1, Transform::kMeanOfAbs);
  Machine signs({of_abs, mean(0.01, 0.1)});
  Machine sizes({mean(0.01, 0.1)});
  for (int t = 0; t < 200; ++t) {
    const auto x = static_cast<float>(std::sin(0.7 * t));
    const auto& seen = signs.advance({x});
    EXPECT_EQ(seen[0], sizes.advance({std::abs(x)})[0]);
    EXPECT_GE(seen[0], std::abs(seen[1]) - 1e-6F);
  }
}

TEST(FeatureState, ASlowMeanReachesAConstantInput) {
  constexpr double kTimeConstantS = 100.0;
  constexpr double kTickS = 0.001;
  // Long before it is there its steps are smaller than the last digit of its state.
  for (const auto& [first, then] : {std::pair{0.0F, 1.2345F}, std::pair{1000.0F, 1000.01F},
                                    std::pair{-3.0F, 1e-4F}, std::pair{5.0F, -0.7F}}) {
    Machine machine({mean(kTickS, kTimeConstantS)});
    machine.advance({first});
    for (int tick = 0; tick < 3'000'000; ++tick)
      machine.state.advance({&then, 1}, machine.features);
    EXPECT_NEAR(machine.features[0], then, 1e-6F * std::abs(then)) << "from " << first;
  }
}

TEST(FeatureState, ASlowMeanOfNoiseIsThatOfDoublePrecision) {
  std::mt19937 random(11);
  std::normal_distribution<float> normal(0.3F, 2.0F);
  Machine machine({mean(0.001, 100.0)});
  const auto gain = static_cast<double>(machine.ops[0].gain);
  double expected = 0.0;
  for (int tick = 0; tick < 500'000; ++tick) {
    const float x = normal(random);
    const auto now = static_cast<double>(x);
    expected = tick == 0 ? now : expected + gain * (now - expected);
    machine.state.advance({&x, 1}, machine.features);
  }
  EXPECT_NEAR(static_cast<double>(machine.features[0]), expected, 1e-6);
}

TEST(FeatureState, ANotANumberDoesNotDisturbAMean) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const std::vector<FeatureOp> ops = {mean(0.01, 0.1), mean(0.01, 0.1, Transform::kMeanOfAbs)};
  Machine disturbed(ops);
  Machine whole(ops);
  EXPECT_TRUE(std::isnan(disturbed.advance({kNan})[1]));
  for (int t = 0; t < 50; ++t) {
    const auto x = static_cast<float>(std::sin(0.7 * t));
    EXPECT_EQ(disturbed.advance({x}), whole.advance({x})) << t;
    for (const float lost : {kNan, kInfinity, -kInfinity}) {
      for (const float seen : disturbed.advance({lost})) EXPECT_FALSE(std::isfinite(seen));
    }
  }
}

TEST(FeatureState, NeedsMemoryForItsLagsOnly) {
  const std::array<FeatureOp, 1> plain = {value()};
  const std::array<FeatureOp, 2> lagged = {lag(3), lag(10, 1)};
  EXPECT_EQ(FeatureState::memory_floats(plain, 5), 1U);
  EXPECT_EQ(FeatureState::memory_floats(lagged, 5), 2U + 11U * 5U);
  const std::array<FeatureOp, 2> meant = {lag(3), mean(0.01, 0.1)};
  EXPECT_EQ(FeatureState::memory_floats(meant, 5), 2U + 2U + 4U * 5U);
}

}  // namespace
}  // namespace ravencal::model
