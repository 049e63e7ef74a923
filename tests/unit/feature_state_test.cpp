// SPDX-License-Identifier: Apache-2.0
#include "model/feature_state.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <vector>

namespace ravencal::model {
namespace {

FeatureOp value(std::uint32_t source = 0) { return {source, Transform::kValue, 0, 0.0F}; }
FeatureOp lag(std::uint32_t ticks, std::uint32_t source = 0) {
  return {source, Transform::kLag, ticks, 0.0F};
}
FeatureOp play(float half_width) { return {0, Transform::kPlay, 0, half_width}; }

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
  Machine machine({lag(2), play(1.0F)});
  for (int t = 0; t < 7; ++t) machine.advance({static_cast<float>(t)});
  machine.state.reset();
  EXPECT_EQ(machine.advance({100.0F}), (std::vector<float>{100.0F, 100.0F}));
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

TEST(FeatureState, NeedsMemoryForItsLagsOnly) {
  const std::array<FeatureOp, 1> plain = {value()};
  const std::array<FeatureOp, 2> lagged = {lag(3), lag(10, 1)};
  EXPECT_EQ(FeatureState::memory_floats(plain, 5), 1U);
  EXPECT_EQ(FeatureState::memory_floats(lagged, 5), 2U + 11U * 5U);
}

}  // namespace
}  // namespace ravencal::model
