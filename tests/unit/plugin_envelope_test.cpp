// SPDX-License-Identifier: Apache-2.0
//
// How the loaded plugin fades, refuses and recovers, seen only through its C ABI.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/run_level.hpp"
#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

// Of make_model.
constexpr std::array<float, RAVENCAL_JOINTS> kConstant = {0.02F, -0.05F, 0.003F};
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

class Envelope : public ::testing::Test {
 protected:
  void SetUp() override { rig.load(make_model(16, {})); }  // the joints of both arms

  void activate() {
    rig.enable();
    ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  }

  /// After `disturb` the correction must reach zero and the state `resting`, never by a step.
  template <typename Disturb>
  void expect_fade_out(Disturb disturb, std::int32_t resting, std::uint32_t doubt) {
    activate();
    disturb();
    EXPECT_EQ(rig.tick(), RAVENCAL_HELD);
    EXPECT_EQ(rig.output.doubts & doubt, doubt);
    EXPECT_EQ(rig.output.state, RAVENCAL_STATE_FADING_OUT);
    EXPECT_NE(rig.output.correction_ji[0], 0.0F);
    ASSERT_TRUE(rig.tick_until(resting));
    for (const float correction : rig.output.correction_ji) EXPECT_EQ(correction, 0.0F);
  }

  /// Doubts that may pass: the correction first stays as it is for hold_ns, then becomes its
  /// constant part, the model's output mean, as far as it was as large.
  template <typename Disturb>
  void expect_hold_and_constant(Disturb disturb, std::uint32_t doubt) {
    activate();
    const float before = rig.output.correction_ji[0];
    disturb();
    for (std::uint32_t held_ns = 0; held_ns < rig.config.hold_ns; held_ns += 1'000'000) {
      EXPECT_EQ(rig.tick(), RAVENCAL_HELD);
      EXPECT_EQ(rig.output.doubts & doubt, doubt);
      EXPECT_EQ(rig.output.state, RAVENCAL_STATE_HOLD);
      EXPECT_EQ(rig.output.correction_ji[0], before);
    }
    EXPECT_EQ(rig.tick(), RAVENCAL_HELD);
    expect_constant();
  }

  void expect_constant() {
    const auto before = std::to_array(rig.output.correction_ji);
    ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_CONSTANT));
    EXPECT_EQ(rig.tick(), RAVENCAL_HELD);
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      const bool was_larger = std::fabs(before[j]) > std::fabs(kConstant[j]);
      EXPECT_EQ(rig.output.correction_ji[j], was_larger ? kConstant[j] : before[j]) << j;
    }
  }

  Rig rig;
};

TEST_F(Envelope, IsTheRobotsOwnValueBitForBitUntilItIsEnabled) {
  rig.state.arm[0].jpos_ji[1] = -0.0F;
  EXPECT_EQ(rig.tick(), RAVENCAL_BYPASS);
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_OFF);
  EXPECT_EQ(std::memcmp(rig.output.jpos_ji, rig.state.arm[0].jpos_ji, sizeof rig.output.jpos_ji),
            0);
}

TEST_F(Envelope, ArmsFadesInAndReachesThePrediction) {
  rig.enable();
  rig.tick();
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_ARMED);
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_FADING_IN));
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  for (int j = 0; j < RAVENCAL_JOINTS; ++j) {
    EXPECT_EQ(rig.output.correction_ji[j], rig.output.predicted_ji[j]);
    EXPECT_EQ(rig.output.jpos_ji[j], rig.state.arm[0].jpos_ji[j] + rig.output.correction_ji[j]);
  }
}

TEST_F(Envelope, StaysArmedWithoutWeights) {
  Rig empty;
  empty.enable();
  EXPECT_FALSE(empty.tick_until(RAVENCAL_STATE_FADING_IN, 1000));
  EXPECT_EQ(empty.output.state, RAVENCAL_STATE_ARMED);
  EXPECT_EQ(empty.output.doubts, RAVENCAL_DOUBT_NO_WEIGHTS);
}

TEST_F(Envelope, FadesOutWhenDisabled) {
  expect_fade_out([&] { rig.enable(false); }, RAVENCAL_STATE_OFF, 0);
}

TEST_F(Envelope, FadesOutInEmergencyStop) {
  expect_fade_out([&] { rig.state.runlevel = core::kEmergencyStop; }, RAVENCAL_STATE_ARMED,
                  RAVENCAL_DOUBT_ROBOT_STATE);
}

TEST_F(Envelope, HasNoCorrectionFromTheFirstCycleOfHomingOnAlsoWhenTheClockStands) {
  activate();
  rig.state.runlevel = core::kInit;
  rig.state.t_ns -= rig.config.tick_ns;
  EXPECT_EQ(rig.tick(), RAVENCAL_BYPASS);
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_ARMED);
  for (const float correction : rig.output.correction_ji) EXPECT_EQ(correction, 0.0F);
}

TEST_F(Envelope, FadesOutWhenAJointIsNotReady) {
  expect_fade_out([&] { rig.state.arm[0].joints_ready = 0xFB; }, RAVENCAL_STATE_ARMED,
                  RAVENCAL_DOUBT_ROBOT_STATE);
}

TEST_F(Envelope, IgnoresToolJointsThatAreNotReady) {
  activate();
  rig.state.arm[0].joints_ready = 0x07;
  EXPECT_EQ(rig.tick(), RAVENCAL_OK);
}

TEST_F(Envelope, HoldsTheCorrectionWhileThePedalMoves) {
  activate();
  const float initially = rig.output.correction_ji[0];
  for (const std::int32_t runlevel : {3, 2}) {
    const float before = rig.output.correction_ji[0];
    rig.state.runlevel = runlevel;
    rig.state.arm[0].jpos_ji[0] += 0.01F;  // asks for something else
    for (int i = 0; i < 20; ++i) {
      EXPECT_EQ(rig.tick(), RAVENCAL_HELD);
      EXPECT_EQ(rig.output.state, RAVENCAL_STATE_HOLD);
      EXPECT_EQ(rig.output.doubts, RAVENCAL_DOUBT_PEDAL);
      EXPECT_EQ(rig.output.correction_ji[0], before);
    }
    rig.state.arm[0].jpos_d_ji[0] -= 0.02F;
    EXPECT_EQ(rig.tick(), RAVENCAL_OK);
    rig.state.arm[0].jpos_ji[0] -= 0.01F;
    rig.tick();
    EXPECT_NE(rig.output.correction_ji[0], before) << "it follows the joints again";
  }
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  for (int i = 0; i < 200; ++i) rig.tick();
  EXPECT_EQ(rig.output.correction_ji[0], initially) << "the pedal is up: no offset is left";
}

TEST_F(Envelope, HoldsThenAppliesTheConstantPartOnANotANumber) {
  expect_hold_and_constant([&] { rig.state.arm[0].jpos_ji[5] = kNan; }, RAVENCAL_DOUBT_NOT_FINITE);
}

TEST_F(Envelope, HoldsThenAppliesTheConstantPartOnAnInfinity) {
  expect_hold_and_constant(
      [&] { rig.state.arm[0].jpos_ji[5] = std::numeric_limits<float>::infinity(); },
      RAVENCAL_DOUBT_NOT_FINITE);
}

TEST_F(Envelope, HoldsThenAppliesTheConstantPartFarOutsideTheTrainedRange) {
  expect_hold_and_constant([&] { rig.state.arm[0].jpos_ji[0] += 1.05F; },
                           RAVENCAL_DOUBT_OUT_OF_RANGE);
}

TEST_F(Envelope, ExtrapolatesHalfAWidthAndClampsFromThere) {
  rig.load(make_model({plain("jpos.elbow"), plain("mvel.elbow")}, {}));
  activate();
  float& speed = rig.state.arm[0].mvel_rad_per_s[1];
  const float middle = speed;  // trained on middle +- 0.5: clamped at +- 1, doubted from +- 1.5
  const auto predicted_at = [&](float offset) {
    speed = middle + offset;
    rig.tick();
    EXPECT_EQ(rig.output.doubts, 0U);
    return rig.output.predicted_ji[0];
  };
  const float slope = predicted_at(0.5F) - predicted_at(0.0F);
  EXPECT_NEAR(predicted_at(0.9F) - predicted_at(0.5F), 0.8 * static_cast<double>(slope), 1e-6);
  EXPECT_EQ(rig.instance.counters().clamped_inputs, 0U);
  EXPECT_EQ(predicted_at(1.1F), predicted_at(1.4F));
  EXPECT_EQ(rig.instance.counters().clamped_inputs, 2U);
}

TEST_F(Envelope, ShowsTheNetworkAConstantAsTrainingSawIt) {
  model::CalibrationModel model = make_model({plain("jpos.elbow"), plain("last_seq")}, {});
  model.input_min[1] = model.input_max[1] = model.input.mean[1];
  model.input.scale[1] = 1.0;
  rig.load(model);
  activate();
  const float before = rig.output.predicted_ji[0];
  rig.state.last_seq = 70000;
  EXPECT_EQ(rig.tick(), RAVENCAL_OK);
  EXPECT_EQ(rig.output.predicted_ji[0], before);
}

TEST_F(Envelope, HoldsAndGoesOnWhenTimeJumpsOnce) {
  for (const std::int64_t jump_ns : {5'000'000'000LL, -5'000'000'000LL, 11'000'000LL}) {
    activate();
    const float before = rig.output.correction_ji[1];
    rig.state.t_ns += jump_ns;
    EXPECT_EQ(rig.tick(), RAVENCAL_HELD);
    EXPECT_EQ(rig.output.doubts, RAVENCAL_DOUBT_TIME);
    EXPECT_EQ(rig.output.state, RAVENCAL_STATE_HOLD);
    EXPECT_EQ(rig.output.correction_ji[1], before);
    EXPECT_EQ(rig.tick(), RAVENCAL_OK);
    EXPECT_EQ(rig.output.state, RAVENCAL_STATE_ACTIVE);
    for (int i = 0; i < 200; ++i) rig.tick();
  }
}

TEST_F(Envelope, AppliesTheConstantPartOnADoubtThatComesAndGoes) {
  activate();
  int held = 0;
  for (int i = 0; i < 1000 && rig.output.state != RAVENCAL_STATE_CONSTANT; ++i) {
    const float sound = healthy_state().arm[0].jpos_ji[5];
    rig.state.arm[0].jpos_ji[5] = i % 2 == 0 ? kNan : sound;
    rig.tick();
    held += rig.output.state == RAVENCAL_STATE_HOLD ? 1 : 0;
  }
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_CONSTANT);
  EXPECT_EQ(held, 20);
}

TEST_F(Envelope, EndsAHoldAtOnceInEmergencyStop) {
  activate();
  rig.state.arm[0].jpos_ji[5] = kNan;
  rig.tick();
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_HOLD);
  rig.state.runlevel = core::kEmergencyStop;
  rig.tick();
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_FADING_OUT);
}

TEST_F(Envelope, HoldsThenAppliesTheConstantPartWhenAMotorCountsTooFast) {
  activate();
  std::int32_t& counts = rig.state.arm[0].enc_counts[2];
  for (int i = 0; i < 100; ++i) {
    counts += 512;
    EXPECT_EQ(rig.tick(), RAVENCAL_OK);
  }
  rig.state.t_ns += 3'000'000;  // a late tick: the motor has turned meanwhile
  counts += 4 * 512;
  EXPECT_EQ(rig.tick(), RAVENCAL_OK);
  counts -= 513;
  EXPECT_EQ(rig.tick(), RAVENCAL_HELD);
  EXPECT_EQ(rig.output.doubts, RAVENCAL_DOUBT_ENCODER_JUMP);
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_HOLD);
  EXPECT_EQ(rig.tick(), RAVENCAL_OK);
  for (int i = 0; i < 4000 && rig.output.state != RAVENCAL_STATE_CONSTANT; ++i) {
    counts += i % 2 == 0 ? 600 : -600;
    rig.tick();
  }
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_CONSTANT);
  EXPECT_NEAR(rig.output.correction_ji[0], kConstant[0], 2e-4);
}

TEST_F(Envelope, AcceptsATickThatIsLateBySchedulingOnly) {
  activate();
  rig.state.t_ns += 4'000'000;
  EXPECT_EQ(rig.tick(), RAVENCAL_OK);
}

TEST_F(Envelope, HoldsThenAppliesTheConstantPartWhenTheNetworkAsksForTooMuch) {
  model::CalibrationModel model = make_model({plain("jpos.shoulder")}, {});
  model.layers[0].weights << 200.0F, 0.0F, 0.0F;  // 0.8 rad per half width of the range
  model.layers[0].biases.setZero();
  rig.load(model);
  expect_hold_and_constant([&] { rig.state.arm[0].jpos_ji[0] += 0.4F; }, RAVENCAL_DOUBT_MAGNITUDE);
}

TEST_F(Envelope, LimitsTheRateInNormalWork) {
  model::CalibrationModel model = make_model({plain("jpos.shoulder")}, {});
  model.layers[0].weights << 10.0F, 0.0F, 0.0F;
  rig.load(model);
  activate();
  const float before = rig.output.correction_ji[0];
  rig.state.arm[0].jpos_ji[0] += 0.4F;
  EXPECT_EQ(rig.tick(), RAVENCAL_OK);
  const float rate = rig.config.max_correction_rate_ji_per_s[0];
  EXPECT_NEAR(rig.output.correction_ji[0] - before, 1e-3F * rate, 1e-6);
  EXPECT_GT(rig.instance.counters().limited_rate, 0U);
}

TEST_F(Envelope, LatchesAFaultOfTheNetworkUntilReset) {
  rig.load(make_model_with_a_flaw());
  expect_fade_out([&] { provoke_flaw(rig.state); }, RAVENCAL_STATE_FAULT, RAVENCAL_DOUBT_NETWORK);
  rig.state = healthy_state(rig.state.t_ns);
  EXPECT_FALSE(rig.tick_until(RAVENCAL_STATE_FADING_IN, 1000)) << "a fault must not heal by itself";
  EXPECT_EQ(rig.tick(), RAVENCAL_FAULT);
  rig.api().reset(rig.instance.get());
  EXPECT_EQ(rig.tick(), RAVENCAL_BYPASS);
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_OFF);
}

TEST_F(Envelope, NeedsThePublishedStateOfTheCycleBefore) {
  rig.load(make_model({plain("tau.elbow"), plain("dac.elbow")}, {}));
  rig.enable();
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  EXPECT_EQ(rig.instance.info().needs_cycle_end, 1U);
  rig.state.t_ns += 1'000'000;
  rig.api().step(rig.instance.get(), &rig.state, &rig.output);  // and no observe_cycle_end
  rig.state.t_ns += 1'000'000;
  EXPECT_EQ(rig.api().step(rig.instance.get(), &rig.state, &rig.output), RAVENCAL_HELD);
  EXPECT_EQ(rig.output.doubts, RAVENCAL_DOUBT_NOT_LATCHED);
}

TEST_F(Envelope, WarmsUpForAsLongAsItsOldestInput) {
  rig.load(make_model({plain("jpos.elbow"), lagged("jpos.elbow", 50)}, {}));
  rig.enable();
  int warming = 0;
  for (int i = 0; i < 1000; ++i) {
    rig.tick();
    warming += (rig.output.doubts & RAVENCAL_DOUBT_WARMING_UP) != 0 ? 1 : 0;
  }
  EXPECT_EQ(warming, 500);  // 50 rows of 10 ms at 1 kHz
}

TEST_F(Envelope, LooksBackTenCyclesPerTrainingRow) {
  model::CalibrationModel model = make_model({plain("jpos.elbow"), lagged("jpos.elbow", 3)}, {});
  model.layers[0].weights << 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 0.0F;  // joint 1: the lagged input alone
  model.layers[0].biases.setZero();
  model.output.mean.setZero();
  model.output.scale.setConstant(0.5);  // undoes the input's scale
  rig.load(model);
  const float middle = rig.state.arm[0].jpos_ji[1];
  for (int i = 0; i < 200; ++i) {
    rig.state.arm[0].jpos_ji[1] = middle + 0.001F * static_cast<float>(i);
    rig.tick();
    if (i < 30) continue;
    EXPECT_NEAR(rig.output.predicted_ji[0], 0.001 * (i - 30), 1e-6);  // 3 rows of 10 ms at 1 kHz
  }
}

TEST_F(Envelope, UncorrectsDesiredJointsByTheAppliedCorrection) {
  activate();
  const float desired[RAVENCAL_JOINTS] = {rig.output.jpos_ji[0], rig.output.jpos_ji[1],
                                          rig.output.jpos_ji[2]};
  float uncorrected[RAVENCAL_JOINTS];
  rig.api().uncorrect_desired(rig.instance.get(), desired, uncorrected);
  // Desired re-seeded from the corrected measurement must give back the uncorrected one, or the
  // motor would jump.
  for (int j = 0; j < RAVENCAL_JOINTS; ++j) {
    EXPECT_NEAR(uncorrected[j], rig.state.arm[0].jpos_ji[j], 1e-7);
  }
}

}  // namespace
}  // namespace ravencal::test
