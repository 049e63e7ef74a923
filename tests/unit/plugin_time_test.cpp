// SPDX-License-Identifier: Apache-2.0
//
// How far a correction may go is a matter of the time that passed on the robot, not of how often
// the plugin is asked.
#include <gtest/gtest.h>

#include <cmath>

#include "core/run_level.hpp"
#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

class Time : public ::testing::Test {
 protected:
  void SetUp() override { rig.load(make_model(16, {})); }

  /// One cycle, so long after the one before.
  void tick_after(std::int64_t passed_ns) {
    rig.state.t_ns += passed_ns - 1'000'000;  // tick() adds a millisecond
    rig.tick();
  }
  void activate() {
    rig.enable();
    ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  }
  /// At the default slew.
  [[nodiscard]] double reach_ji(std::int64_t ns, std::size_t joint = 1) const {
    return static_cast<double>(rig.config.slew_ji_per_s[joint]) * static_cast<double>(ns) * 1e-9;
  }

  Rig rig;
};

TEST_F(Time, OfANanosecondPerStepBringsNoCorrection) {
  rig.enable();
  for (int i = 0; i < 20'000; ++i) tick_after(1);
  ASSERT_EQ(rig.output.state, RAVENCAL_STATE_ARMED) << "0.1 s without a doubt have not passed";
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_FADING_IN));
  const float before_ji = rig.output.correction_ji[1];
  for (int i = 0; i < 20'000; ++i) tick_after(1);
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_FADING_IN);
  EXPECT_LE(std::abs(static_cast<double>(rig.output.correction_ji[1] - before_ji)),
            1.05 * reach_ji(20'000))
      << "but for rounding";
}

TEST_F(Time, OfANanosecondPerStepEndsNoCorrectionEither) {
  activate();
  const float before_ji = rig.output.correction_ji[1];
  rig.state.runlevel = core::kEmergencyStop;
  for (int i = 0; i < 20'000; ++i) tick_after(1);
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_FADING_OUT);
  EXPECT_NEAR(rig.output.correction_ji[1], before_ji, reach_ji(20'000) + 1e-8);
}

TEST_F(Time, PassesAsFastInShortSteps) {
  rig.enable();
  int steps = 0;
  for (; steps < 20'000 && rig.output.state != RAVENCAL_STATE_ACTIVE; ++steps) tick_after(100'000);
  Rig whole;
  whole.load(make_model(16, {}));
  whole.enable();
  int ticks = 0;
  for (; ticks < 2000 && whole.output.state != RAVENCAL_STATE_ACTIVE; ++ticks) whole.tick();
  EXPECT_NEAR(steps, 10 * ticks, 20);
}

TEST_F(Time, OfALateStepCountsAsOneTick) {
  rig.enable();
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_FADING_IN));
  rig.tick();
  const float before_ji = rig.output.correction_ji[1];
  tick_after(9'000'000);
  EXPECT_NEAR(std::abs(rig.output.correction_ji[1] - before_ji), reach_ji(1'000'000), 1e-7);
}

TEST_F(Time, ThatStandsStillHoldsTheCorrectionAndGoingOnFadesIt) {
  activate();
  const float before_ji = rig.output.correction_ji[1];
  for (int i = 0; i < 2000; ++i) {
    tick_after(0);
    ASSERT_EQ(rig.output.doubts, RAVENCAL_DOUBT_TIME);
    ASSERT_EQ(rig.output.correction_ji[1], before_ji);
  }
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_FADING_OUT) << "no longer than hold_ns in HOLD";
  rig.state.runlevel = core::kEmergencyStop;
  EXPECT_TRUE(rig.tick_until(RAVENCAL_STATE_ARMED));
  EXPECT_EQ(rig.output.correction_ji[1], 0.0F);
}

TEST_F(Time, ThatRunsBackMovesNothing) {
  rig.enable();
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_FADING_IN));
  for (int i = 0; i < 1000; ++i) {
    const float before_ji = rig.output.correction_ji[1];
    tick_after(i % 2 == 0 ? -1'000'000'000 : 1);
    ASSERT_NEAR(rig.output.correction_ji[1], before_ji, reach_ji(1) + 1e-9);
  }
}

TEST_F(Time, NotStepsEndsTheDoubtOfAMovedPedal) {
  activate();
  rig.state.runlevel = core::kPedalDown;
  for (int i = 0; i < 1000; ++i) tick_after(10'000);
  EXPECT_EQ(rig.output.doubts, RAVENCAL_DOUBT_PEDAL) << "10 ms";
  for (int i = 0; i < 1001; ++i) tick_after(10'000);
  EXPECT_EQ(rig.output.doubts, 0U) << "20 ms";
}

}  // namespace
}  // namespace ravencal::test
