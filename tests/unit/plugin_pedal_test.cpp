// SPDX-License-Identifier: Apache-2.0
//
// With the pedal down the motors follow the correction: what may move it, by how much, and what
// must not, seen only through the plugin's C ABI.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "core/run_level.hpp"
#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

constexpr float kNotANumber = std::numeric_limits<float>::quiet_NaN();

class PedalDown : public ::testing::Test {
 protected:
  void SetUp() override {
    rig.load(make_model(16, {}));
    rig.enable();
    ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
    rig.set_pedal(true);
  }
  /// Ticks so often; the correction must stay what it is, but for rounding where it goes on.
  void expect_still(int ticks, double rounding = 0.0) {
    const std::array<float, RAVENCAL_JOINTS> before = std::to_array(rig.output.correction_ji);
    for (int i = 0; i < ticks; ++i) {
      rig.tick();
      for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
        ASSERT_NEAR(rig.output.correction_ji[j], before[j], rounding) << "tick " << i;
      }
    }
  }

  Rig rig;
};

TEST_F(PedalDown, KeepsTheCorrectionInEveryDoubtAndLosesItOnceThePedalIsUp) {
  const std::vector<std::pair<const char*, std::function<void()>>> troubles = {
      {"disabled", [&] { rig.enable(false); }},
      {"not a number", [&] { rig.state.arm[0].jpos_ji[5] = kNotANumber; }},
      {"out of range", [&] { rig.state.arm[0].jpos_ji[0] += 1.05F; }},
      {"joint not ready", [&] { rig.state.arm[0].joints_ready = 0xFB; }},
      {"time stands still", [&] { rig.state.t_ns -= 1'000'000; }}};
  for (const auto& [name, make] : troubles) {
    SCOPED_TRACE(name);
    rig.state = healthy_state(rig.state.t_ns);
    rig.enable(true);
    ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
    rig.set_pedal(true);
    make();
    expect_still(1000);
    EXPECT_NE(rig.output.correction_ji[0], rig.instance.info().constant_ji[0]);
    rig.state = healthy_state(rig.state.t_ns);
    rig.state.runlevel = core::kPedalDown;
    expect_still(10);
  }
}

TEST_F(PedalDown, FreezesTheLastCorrectionInAFaultUntilThePedalIsUp) {
  rig.load(make_model_with_a_flaw());
  rig.set_pedal(false);
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  rig.set_pedal(true);
  const float before = rig.output.correction_ji[0];
  provoke_flaw(rig.state);
  EXPECT_EQ(rig.tick(), RAVENCAL_HELD);
  EXPECT_EQ(rig.output.doubts & RAVENCAL_DOUBT_NETWORK, RAVENCAL_DOUBT_NETWORK);
  rig.state = healthy_state(rig.state.t_ns);
  rig.state.runlevel = core::kPedalDown;
  expect_still(1000);
  EXPECT_EQ(rig.output.correction_ji[0], before);
  rig.state.runlevel = core::kPedalUp;
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_FAULT));
  EXPECT_EQ(rig.output.correction_ji[0], 0.0F);
}

TEST_F(PedalDown, TakesOtherWeightsWithoutMovingTheCorrection) {
  model::CalibrationModel other = make_model(16, {}, 7);
  other.output.mean = Eigen::Vector3d(-0.03, 0.02, -0.002);
  rig.load(other);
  expect_still(1000, 1e-8);
  EXPECT_EQ(rig.instance.counters().swaps, 2U);
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_FADING_IN);
  for (int j = 0; j < RAVENCAL_JOINTS; ++j) {
    EXPECT_NEAR(rig.output.correction_ji[j], rig.output.predicted_ji[j] + rig.output.offset_ji[j],
                1e-6);
  }
  rig.set_pedal(false);
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  EXPECT_EQ(rig.output.correction_ji[0], rig.output.predicted_ji[0]);
}

TEST_F(PedalDown, FollowsThePredictionWithAnOffsetAfterADoubt) {
  rig.state.arm[0].jpos_ji[0] += 1.05F;  // far outside
  expect_still(100);
  rig.state.arm[0].jpos_ji[0] -= 0.75F;  // within, but elsewhere
  expect_still(1, 1e-8);
  const float offset = rig.output.offset_ji[0];
  EXPECT_NE(offset, 0.0F);
  const float predicted = rig.output.predicted_ji[0];
  const float before = rig.output.correction_ji[0];
  rig.state.arm[0].jpos_ji[0] -= 0.001F;
  rig.state.arm[0].jpos_d_ji[0] -= 0.001F;
  rig.tick();  // the command is seen at the end of this cycle
  rig.tick();
  EXPECT_NE(rig.output.predicted_ji[0], predicted);
  const float blended = offset - rig.output.offset_ji[0];
  EXPECT_LE(std::fabs(blended), 1e-3F * rig.config.blend_ji_per_s[0] * 1.01F);
  EXPECT_NEAR(rig.output.correction_ji[0] - before,
              rig.output.predicted_ji[0] - predicted - blended, 1e-7);
}

TEST_F(PedalDown, StaysWhereItIsAtStandstillWhateverTheNetworkAnswersTo) {
  for (int i = 0; i < 1000; ++i) {
    // What answers to the motor command: torque, motor speed, the motors themselves.
    const float swing = 0.2F * std::sin(0.03F * static_cast<float>(i));
    ravencal_arm& arm = rig.state.arm[0];
    arm = healthy_state().arm[0];
    arm.jpos_ji[0] += swing;
    arm.tau_n_m[0] += swing;
    arm.mvel_rad_per_s[0] += swing;
    expect_still(1);
  }
}

TEST_F(PedalDown, MovesByAtMostItsShareOfTheCommandedMotion) {
  constexpr float kCommanded = 1e-4F;   // rad per tick: 5.7 deg/s
  rig.state.arm[0].jpos_ji[0] += 0.4F;  // asks for a large change at once
  rig.tick();
  for (int i = 0; i < 200; ++i) {
    const float before = rig.output.correction_ji[0];
    rig.state.arm[0].jpos_d_ji[0] += i % 2 == 0 ? kCommanded : -kCommanded;
    rig.tick();
    const float moved = std::fabs(rig.output.correction_ji[0] - before);
    // The rig's desired joints are without the correction, whose own motion adds to them here.
    EXPECT_LE(moved, rig.config.follow_share * (kCommanded + moved) * 1.01F + 1e-8F);
  }
  EXPECT_NEAR(rig.output.correction_ji[0], rig.output.predicted_ji[0], 1e-5) << "it gets there";
}

TEST_F(PedalDown, ShrinksTheOffsetByTheCommandedMotionAndNoFaster) {
  model::CalibrationModel other = make_model(16, {}, 7);
  other.output.mean = Eigen::Vector3d(-0.03, 0.02, -0.002);
  rig.load(other);
  rig.tick();
  const auto size = [&] { return std::fabs(rig.output.offset_ji[0]); };
  const float whole = size();
  ASSERT_GT(whole, 1e-4F);
  rig.state.arm[0].jpos_d_ji[0] += 4.9e-3F;  // a tremor, and no more
  rig.tick();
  rig.tick();
  EXPECT_EQ(size(), whole);
  rig.state.arm[0].jpos_d_ji[0] += 1.1e-4F;  // seen at the end of this cycle, used in the next
  rig.tick();
  EXPECT_EQ(size(), whole);
  rig.tick();
  EXPECT_NEAR(whole - size(), 1e-6, 3e-7) << "a tenth";
  // The rig's host does not take the correction out of its desired joints: its change is seen as a
  // command, a tenth of a tenth.
  for (int i = 0; i < 5; ++i) rig.tick();
  const float left = size();
  rig.tick();
  EXPECT_EQ(size(), left);
  rig.state.arm[0].jpos_d_ji[0] += 0.5F;
  rig.tick();
  rig.tick();
  EXPECT_NEAR(left - size(), 1e-3 * static_cast<double>(rig.config.blend_ji_per_s[0]), 2e-7)
      << "at most half a count of the motor";
}

TEST_F(PedalDown, KeepsAnOffsetThroughTremorAndNoise) {
  model::CalibrationModel other = make_model(16, {}, 7);
  other.output.mean = Eigen::Vector3d(-0.03, 0.02, -0.002);
  rig.load(other);
  rig.tick();
  const auto before = std::to_array(rig.output.offset_ji);
  const ravencal_arm still = rig.state.arm[0];
  for (const double hz : {4.0, 9.0, 12.0}) {
    for (int i = 0; i < 10'000; ++i) {
      const double sine = std::sin(2.0 * 3.14159265 * hz * i * 1e-3);
      const float noise = i % 2 == 0 ? 1e-6F : -1e-6F;
      // 0.2 mm at the tip, 7 cm from the remote centre, and a micrometre of noise.
      rig.state.arm[0].jpos_d_ji[0] =
          still.jpos_d_ji[0] + static_cast<float>(0.0002 / 0.07 * sine) + noise;
      rig.state.arm[0].jpos_d_ji[1] =
          still.jpos_d_ji[1] + static_cast<float>(0.0002 / 0.07 * sine) + noise;
      rig.state.arm[0].jpos_d_ji[2] =
          still.jpos_d_ji[2] + static_cast<float>(0.0002 * sine) + noise;
      rig.tick();
    }
  }
  const double allowed_ji[] = {0.02 * 3.14159265 / 180.0, 0.02 * 3.14159265 / 180.0, 2e-5};
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    EXPECT_NE(before[j], 0.0F);
    EXPECT_NEAR(rig.output.offset_ji[j], before[j], allowed_ji[j]) << j;
  }
}

TEST_F(PedalDown, BeginsWithoutAStepWhenItIsEnabled) {
  Rig late;
  late.load(make_model(16, {}));
  late.set_pedal(true);
  late.enable();
  ASSERT_TRUE(late.tick_until(RAVENCAL_STATE_FADING_IN));
  for (int i = 0; i < 500; ++i) late.tick();
  for (const float correction : late.output.correction_ji) EXPECT_NEAR(correction, 0.0, 1e-8);
}

}  // namespace
}  // namespace ravencal::test
