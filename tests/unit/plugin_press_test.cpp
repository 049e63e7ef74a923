// SPDX-License-Identifier: Apache-2.0
//
// What keeps a press of the pedal from moving the arm: desired joints that move with the
// correction, limits, and what the first cycle of the press takes away. Seen through the plugin's C
// ABI.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/run_level.hpp"
#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

TEST(DesiredJoints, MoveDesiredJointsWithTheCorrectionWhileTheMotorsDoNotFollow) {
  Rig rig;
  rig.load(make_model(16, {}));
  const float desired = rig.state.arm[0].jpos_d_ji[1];
  const auto cycle = [&] {
    rig.tick();
    rig.state.arm[0].jpos_d_ji[1] = rig.output.desired_ji[1];
    return rig.output.state;
  };
  rig.enable();
  while (cycle() != RAVENCAL_STATE_ACTIVE) {
  }
  EXPECT_NEAR(rig.output.desired_ji[1], desired + rig.output.correction_ji[1], 1e-7);
  rig.enable(false);
  while (cycle() != RAVENCAL_STATE_OFF) {
  }
  EXPECT_NEAR(rig.output.desired_ji[1], desired, 1e-7) << "without an error that adds up";
  cycle();
  EXPECT_EQ(rig.output.desired_ji[1], rig.state.arm[0].jpos_d_ji[1]) << "bit for bit";
}

TEST(EnvelopeLimits, TakeTheLargestCorrectionThatStaysInsideWhileThePedalIsUp) {
  const float own = healthy_state().arm[0].jpos_ji[1];
  Rig rig([&](ravencal_config& config) { config.lowest_ji[1] = own - 0.01F; });
  rig.load(make_model(16, {}));
  rig.enable();
  for (int i = 0; i < 1000; ++i) rig.tick();
  EXPECT_EQ(rig.output.doubts, RAVENCAL_DOUBT_LIMIT);
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_FADING_IN);
  EXPECT_NEAR(rig.output.correction_ji[1], -0.01F + 1e-4F, 1e-6) << "it asks for -0.05";
  const float before = rig.output.correction_ji[1];
  rig.set_pedal(true);
  rig.state.arm[0].jpos_ji[1] = own - 0.02F;
  for (int i = 0; i < 1000; ++i) rig.tick();
  EXPECT_EQ(rig.output.correction_ji[1], before) << "never clipped with the pedal down";
  EXPECT_EQ(rig.output.doubts & RAVENCAL_DOUBT_LIMIT, 0U);
  rig.set_pedal(false);
  EXPECT_EQ(rig.output.correction_ji[1], 0.0F) << "outside already: none";
}

/// A host that does not move its desired joints with the correction: inverse kinematics set them to
/// the measured ones, and then fail.
class StubbornHost : public ::testing::Test {
 protected:
  void SetUp() override {
    rig.load(make_model(16, {}));
    rig.enable();
  }
  void cycle() {
    rig.tick();
    rig.api().uncorrect_command(rig.instance.get(), desired_ji.data(), 0, motor_ji.data());
  }
  /// Desired joints are the measured ones with the correction of now, and stay there.
  void seed() {
    ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
    std::copy_n(rig.state.arm[0].jpos_d_ji, RAVENCAL_JOINTS, desired_ji.begin());
    cycle();
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      rig.state.arm[0].jpos_d_ji[j] = desired_ji[j] = rig.output.jpos_ji[j];
    }
    rig.api().uncorrect_command(rig.instance.get(), desired_ji.data(), 0, motor_ji.data());
    seeded_ji = std::to_array(rig.output.correction_ji);
    motor_before_ji = motor_ji;
  }
  void wait(int ticks) {
    for (int i = 0; i < ticks; ++i) cycle();
  }

  Rig rig;
  std::array<float, RAVENCAL_JOINTS> desired_ji{};
  std::array<float, RAVENCAL_JOINTS> motor_ji{};
  std::array<float, RAVENCAL_JOINTS> motor_before_ji{};
  std::array<float, RAVENCAL_JOINTS> seeded_ji{};
};

TEST_F(StubbornHost, IsHeldToTheSmallerCorrectionAtAPressWhichThenMovesNoMotor) {
  rig.api().set_share(rig.instance.get(), 0.25F, 7);
  seed();
  rig.api().set_share(rig.instance.get(), 1.0F, 7);
  wait(1000);
  EXPECT_GT(std::fabs(motor_ji[1] - motor_before_ji[1]), 0.01F) << "the press would drive this";
  rig.state.runlevel = core::kPedalDown;
  for (int i = 0; i < 100; ++i) {
    cycle();
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      EXPECT_NEAR(motor_ji[j], motor_before_ji[j], 1e-7) << j;
      if (i == 0) continue;
      EXPECT_NEAR(rig.output.correction_ji[j], seeded_ji[j], 1e-7);
      EXPECT_EQ(rig.output.doubts & RAVENCAL_DOUBT_PRESS, RAVENCAL_DOUBT_PRESS);
    }
  }
  EXPECT_EQ(rig.instance.counters().ticks_in_doubt[14], 99U);
  rig.state.runlevel = core::kPedalUp;
  cycle();
  EXPECT_EQ(rig.output.doubts & RAVENCAL_DOUBT_PRESS, 0U);
}

TEST_F(StubbornHost, NeverGetsALargerCorrectionAtAPress) {
  seed();
  rig.api().set_share(rig.instance.get(), 0.25F, 7);
  wait(1000);
  const auto before = std::to_array(rig.output.correction_ji);
  rig.state.runlevel = core::kPedalDown;
  wait(2);
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    EXPECT_EQ(rig.output.correction_ji[j], before[j]) << j;
  }
  EXPECT_EQ(rig.output.doubts & RAVENCAL_DOUBT_PRESS, RAVENCAL_DOUBT_PRESS) << "but it is seen";
}

TEST_F(StubbornHost, GetsNoCorrectionInOff) {
  seed();
  rig.enable(false);
  while (rig.output.state != RAVENCAL_STATE_OFF) cycle();
  rig.state.runlevel = core::kPedalDown;
  for (int i = 0; i < 100; ++i) {
    cycle();
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      EXPECT_EQ(rig.output.correction_ji[j], 0.0F);
      EXPECT_EQ(motor_ji[j], desired_ji[j]) << "bit for bit, as without the plugin";
    }
  }
  EXPECT_EQ(rig.output.doubts & RAVENCAL_DOUBT_PRESS, 0U);
}

TEST(MotorSide, StaysWithinTheLimitsWhileTheMotorsFollow) {
  const float own = healthy_state().arm[0].jpos_ji[1];
  Rig rig([&](ravencal_config& config) { config.highest_ji[1] = own + 0.02F; });
  rig.load(make_model(16, {}));
  rig.enable();
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  std::array<float, RAVENCAL_JOINTS> desired_ji{};
  std::array<float, RAVENCAL_JOINTS> motor_ji{};
  const auto cycle = [&](float elbow_ji) {
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      rig.state.arm[0].jpos_d_ji[j] = desired_ji[j] = rig.output.jpos_ji[j];
    }
    rig.state.arm[0].jpos_d_ji[1] = desired_ji[1] = elbow_ji + rig.output.correction_ji[1];
    rig.tick();
    rig.api().uncorrect_command(rig.instance.get(), desired_ji.data(), 0, motor_ji.data());
    return motor_ji[1];
  };
  cycle(own);
  rig.state.runlevel = core::kPedalDown;
  for (int i = 0; i < 30; ++i) EXPECT_NEAR(cycle(own), own, 1e-6);
  EXPECT_NEAR(cycle(own + 0.015F), own + 0.015F, 1e-6) << "inside: as commanded";
  EXPECT_EQ(cycle(own + 0.05F), own + 0.02F) << "corrected limits would let it";
  rig.tick();
  EXPECT_EQ(rig.output.doubts & RAVENCAL_DOUBT_LIMIT, RAVENCAL_DOUBT_LIMIT);
  EXPECT_NEAR(cycle(own), own, 1e-6) << "back at once";

  // A press that begins beyond a limit goes nowhere by itself, inward freely, outward not at all.
  rig.state.runlevel = core::kPedalUp;
  for (int i = 0; i < 30; ++i) cycle(own + 0.03F);
  rig.state.runlevel = core::kPedalDown;
  EXPECT_NEAR(cycle(own + 0.03F), own + 0.03F, 1e-6);
  EXPECT_NEAR(cycle(own + 0.04F), own + 0.03F, 1e-6);
  EXPECT_NEAR(cycle(own + 0.025F), own + 0.025F, 1e-6);
  EXPECT_NEAR(cycle(own + 0.03F), own + 0.025F, 1e-6);
}

}  // namespace
}  // namespace ravencal::test
