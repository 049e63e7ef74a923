// SPDX-License-Identifier: Apache-2.0
//
// What keeps a press of the pedal from moving the arm: desired joints that move with the
// correction, limits, and the comparison in the first cycle of the press. Seen through the plugin's
// C ABI.
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
  rig.enable();
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  const float desired = rig.state.arm[0].jpos_d_ji[1];
  const float before = rig.output.correction_ji[1];
  rig.enable(false);
  rig.tick();
  rig.state.arm[0].jpos_d_ji[1] = rig.output.desired_ji[1];
  ASSERT_TRUE([&] {
    while (rig.output.state != RAVENCAL_STATE_OFF) {
      rig.tick();
      rig.state.arm[0].jpos_d_ji[1] = rig.output.desired_ji[1];
    }
    return true;
  }());
  EXPECT_NEAR(rig.output.desired_ji[1], desired - before, 1e-7) << "without an error that adds up";
  rig.tick();
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

/// A host that does not move its desired joints with the correction.
TEST(PressCheck, KeepsTheCorrectionWithWhichAPressMovesNoMotor) {
  Rig rig;
  rig.load(make_model(16, {}));
  rig.enable();
  float motor_ji[RAVENCAL_JOINTS];
  float desired_ji[RAVENCAL_JOINTS];
  const auto cycle = [&] {
    const std::int32_t status = rig.tick();
    rig.api().uncorrect_command(rig.instance.get(), desired_ji, 0, motor_ji);
    return status;
  };
  // Inverse kinematics set the desired joints to the measured ones, and then fail.
  for (int i = 0; i < 1000; ++i) {
    std::copy_n(rig.state.arm[0].jpos_d_ji, RAVENCAL_JOINTS, desired_ji);
    cycle();
    for (int j = 0; j < RAVENCAL_JOINTS; ++j) {
      rig.state.arm[0].jpos_d_ji[j] = desired_ji[j] = rig.output.jpos_ji[j];
    }
    rig.api().uncorrect_command(rig.instance.get(), desired_ji, 0, motor_ji);
  }
  ASSERT_EQ(rig.output.state, RAVENCAL_STATE_ACTIVE);
  const auto before = std::to_array(rig.output.correction_ji);
  const auto motor_before = std::to_array(motor_ji);
  rig.enable(false);
  while (rig.output.state != RAVENCAL_STATE_OFF) cycle();
  EXPECT_GT(std::fabs(motor_ji[1] - motor_before[1]), 0.01F) << "the next press would drive this";
  rig.state.runlevel = core::kPedalDown;
  cycle();
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    EXPECT_NEAR(motor_ji[j], motor_before[j], 1e-7) << j;
  }
  for (int i = 0; i < 100; ++i) {
    cycle();
    EXPECT_EQ(rig.output.doubts & RAVENCAL_DOUBT_PRESS, RAVENCAL_DOUBT_PRESS);
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      EXPECT_NEAR(rig.output.correction_ji[j], before[j], 1e-7);
      EXPECT_NEAR(motor_ji[j], motor_before[j], 1e-7) << j;
    }
  }
  EXPECT_EQ(rig.instance.counters().ticks_in_doubt[14], 100U);
  rig.state.runlevel = core::kPedalUp;
  cycle();
  EXPECT_EQ(rig.output.doubts & RAVENCAL_DOUBT_PRESS, 0U);
}

}  // namespace
}  // namespace ravencal::test
