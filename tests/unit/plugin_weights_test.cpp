// SPDX-License-Identifier: Apache-2.0
//
// Weights that come while others run, and that go because they are at fault.
#include <gtest/gtest.h>

#include <cmath>

#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

class Weights : public ::testing::Test {
 protected:
  void activate() {
    rig.enable();
    ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  }

  Rig rig;
};

TEST_F(Weights, AreReachedByTheSlew) {
  rig.load(make_model(16, {}));
  activate();
  model::CalibrationModel model = make_model(16, {});
  model.output.mean[0] += 0.05;
  rig.load(model);
  const auto slew = static_cast<double>(rig.config.slew_ji_per_s[0]);
  auto before = static_cast<double>(rig.output.correction_ji[0]);
  rig.tick();
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_FADING_IN);
  for (int i = 0; rig.output.state != RAVENCAL_STATE_ACTIVE; ++i) {
    const auto now = static_cast<double>(rig.output.correction_ji[0]);
    EXPECT_LE(std::abs(now - before), slew * 1e-3 + 1e-8);
    before = now;
    ASSERT_LT(i, 2000);
    rig.tick();
  }
  EXPECT_EQ(rig.output.correction_ji[0], rig.output.predicted_ji[0]);
}

TEST_F(Weights, FillTheirMemoryBesideThoseInUse) {
  rig.load(make_model({plain("jpos.elbow")}, {}));
  activate();
  rig.load(make_model({plain("jpos.elbow"), lagged("jpos.elbow", 50)}, {}));
  for (int i = 0; i < 500; ++i) {  // 50 rows of 10 ms at 1 kHz
    EXPECT_EQ(rig.tick(), RAVENCAL_OK);
    EXPECT_EQ(rig.output.state, RAVENCAL_STATE_ACTIVE);
    EXPECT_EQ(rig.instance.counters().swaps, 1U);
  }
  EXPECT_EQ(rig.tick(), RAVENCAL_OK);
  EXPECT_EQ(rig.output.doubts, 0U);
  EXPECT_EQ(rig.instance.counters().swaps, 2U);
}

TEST_F(Weights, RememberTheSameWhetherOthersRanMeanwhileOrNot) {
  const model::CalibrationModel model = make_model(
      {plain("jpos.elbow"), lagged("jpos.elbow", 3), with_play("jpos.elbow", 0.02F)}, {});
  Rig other;
  other.load(model);
  rig.load(make_model({plain("jpos.elbow")}, {}));
  rig.tick();
  other.tick();
  rig.load(model);
  for (int i = 0; i < 200; ++i) {
    const float moved = 0.1F * std::sin(0.05F * static_cast<float>(i));
    rig.state.arm[0].jpos_ji[1] = other.state.arm[0].jpos_ji[1] =
        healthy_state().arm[0].jpos_ji[1] + moved;
    rig.tick();
    other.tick();
    if (i < 130) continue;  // play operators forget where they started
    EXPECT_EQ(rig.output.predicted_ji[0], other.output.predicted_ji[0]) << i;
  }
  EXPECT_EQ(rig.instance.counters().swaps, 2U);
}

TEST_F(Weights, ThatAreAtFaultGiveWayToTheOnesBefore) {
  const model::CalibrationModel sound = make_model(16, {});
  rig.load(sound);
  activate();
  const float wanted = rig.output.predicted_ji[0];
  rig.load(make_model_with_a_flaw());
  activate();
  EXPECT_NE(rig.output.predicted_ji[0], wanted);
  provoke_flaw(rig.state);
  EXPECT_EQ(rig.tick(), RAVENCAL_HELD);
  EXPECT_EQ(rig.output.doubts, RAVENCAL_DOUBT_NETWORK);
  for (const float predicted : rig.output.predicted_ji) EXPECT_TRUE(std::isfinite(predicted));
  EXPECT_EQ(rig.instance.counters().rollbacks, 1U);

  rig.state = healthy_state(rig.state.t_ns);
  rig.tick();
  EXPECT_EQ(rig.output.predicted_ji[0], wanted) << "the weights before run again";
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_FAULT));
  EXPECT_FALSE(rig.tick_until(RAVENCAL_STATE_FADING_IN, 1000)) << "but the fault stays";
  rig.api().reset(rig.instance.get());
  rig.tick();
  activate();
  EXPECT_EQ(rig.output.correction_ji[0], wanted);
  EXPECT_EQ(rig.instance.counters().rollbacks, 1U);
}

TEST_F(Weights, ThatHaveProvenThemselvesStay) {
  rig.load(make_model(16, {}));
  activate();
  rig.load(make_model_with_a_flaw());
  activate();
  for (int i = 0; i < 1000; ++i) rig.tick();
  provoke_flaw(rig.state);
  rig.tick();
  EXPECT_EQ(rig.output.doubts, RAVENCAL_DOUBT_NETWORK);
  EXPECT_EQ(rig.instance.counters().rollbacks, 0U);
}

TEST_F(Weights, ThatFailedAreNotReturnedTo) {
  rig.load(make_model_with_a_flaw());
  activate();
  provoke_flaw(rig.state);
  rig.tick();
  rig.load(make_model_with_a_flaw());
  rig.tick();
  rig.tick();
  EXPECT_EQ(rig.instance.counters().swaps, 2U);
  EXPECT_EQ(rig.instance.counters().rollbacks, 0U);
}

TEST_F(Weights, FallBackOnTheProvenOnesThroughAnyNumberOfOthers) {
  rig.load(make_model(16, {}));
  activate();
  const float wanted = rig.output.predicted_ji[0];
  for (int i = 0; i < 5; ++i) {
    rig.load(make_model_with_a_flaw());
    rig.tick();
  }
  provoke_flaw(rig.state);
  rig.tick();
  EXPECT_EQ(rig.instance.counters().rollbacks, 1U);
  rig.state = healthy_state(rig.state.t_ns);
  rig.tick();
  EXPECT_EQ(rig.output.predicted_ji[0], wanted);
}

}  // namespace
}  // namespace ravencal::test
