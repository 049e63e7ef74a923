// SPDX-License-Identifier: Apache-2.0
//
// The constant of a homing: taken with the pedal up only, faded, bounded, and gone with the homing
// or the weights that it belongs to. Seen through the plugin's C ABI.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>

#include "core/run_level.hpp"
#include "ravencal/control.h"
#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

using Joints = std::array<float, RAVENCAL_JOINTS>;

class HomingConstant : public ::testing::Test {
 protected:
  static constexpr Joints kConstant_ji = {0.02F, -0.03F, 0.002F};

  void SetUp() override {
    rig.load(make_model(16, {}));
    rig.tick();  // the weights are in use now
  }

  [[nodiscard]] ravencal_homing_constant constant(Joints ji = kConstant_ji) const {
    ravencal_homing_constant made{};
    made.struct_size = sizeof made;
    made.weights_checksum = rig.instance.info().checksum;
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      made.constant_ji[j] = ji[j];
      made.enc_offset_counts[j] = rig.state.arm[0].enc_offset_counts[j];
    }
    return made;
  }
  std::int32_t offer(const ravencal_homing_constant& made) {
    return rig.api().set_homing_constant(rig.instance.get(), &made);
  }
  void arm() {
    rig.enable();
    ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  }
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) rig.tick();
  }
  /// Long enough for any fade.
  void expect_added(const Joints& ji, const std::string& when) {
    run(1500);
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      EXPECT_NEAR(rig.output.correction_ji[j], rig.output.predicted_ji[j] + ji[j], 1e-6)
          << when << ", joint " << j;
    }
  }

  Rig rig;
};

TEST_F(HomingConstant, IsTakenWithThePedalUpAndFaded) {
  arm();
  rig.set_pedal(true);
  const auto before = std::to_array(rig.output.correction_ji);
  ASSERT_EQ(offer(constant()), RAVENCAL_SUCCESS);
  for (int i = 0; i < 500; ++i) {
    rig.tick();
    ASSERT_EQ(std::to_array(rig.output.correction_ji), before) << "the pedal is down";
  }
  rig.state.runlevel = core::kPedalUp;
  Joints last = before;
  int moved = 0;
  for (int i = 0; i < 1000; ++i) {
    rig.tick();
    bool has_moved = false;
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      const float step_ji = std::fabs(rig.output.correction_ji[j] - last[j]);
      ASSERT_LE(step_ji, 1.001e-3F * rig.config.slew_ji_per_s[j]) << "it fades";
      has_moved = has_moved || step_ji > 0.0F;
      last[j] = rig.output.correction_ji[j];
    }
    moved += has_moved ? 1 : 0;
  }
  EXPECT_GT(moved, 30);
  expect_added(kConstant_ji, "pedal up");
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_ACTIVE);
  rig.set_pedal(true);
  expect_added(kConstant_ji, "pedal down");
}

TEST_F(HomingConstant, IsGoneAtTheNextHoming) {
  arm();
  ASSERT_EQ(offer(constant()), RAVENCAL_SUCCESS);
  expect_added(kConstant_ji, "taken");
  rig.state.runlevel = core::kInit;
  rig.tick();
  for (const float correction_ji : rig.output.correction_ji) EXPECT_EQ(correction_ji, 0.0F);
  run(100);
  rig.state.runlevel = core::kPedalUp;  // the same offsets, by chance
  expect_added({}, "homed again");

  ASSERT_EQ(offer(constant()), RAVENCAL_SUCCESS);
  expect_added(kConstant_ji, "taken again");
  ++rig.state.arm[0].enc_offset_counts[1];
  expect_added({}, "another offset without INIT");
  --rig.state.arm[0].enc_offset_counts[1];
  expect_added({}, "it does not come back");

  ASSERT_EQ(offer(constant()), RAVENCAL_SUCCESS);
  expect_added(kConstant_ji, "taken a third time");
  rig.state.arm[0].joints_ready = 0;
  run(10);
  rig.state.arm[0].joints_ready = 7;
  expect_added({}, "a joint was not ready");
}

// What waits for the pedal belongs to the homing in which it was offered.
TEST_F(HomingConstant, ThatWaitsGoesWithTheHomingToo) {
  arm();
  rig.set_pedal(true);
  ASSERT_EQ(offer(constant()), RAVENCAL_SUCCESS);
  run(10);
  rig.state.runlevel = core::kInit;
  run(10);
  rig.state.runlevel = core::kPedalUp;
  expect_added({}, "homed again");
}

TEST_F(HomingConstant, OfOtherWeightsOrAnotherHomingIsIgnored) {
  arm();
  ravencal_homing_constant other = constant();
  other.weights_checksum ^= 1U;
  EXPECT_EQ(offer(other), RAVENCAL_SUCCESS);
  expect_added({}, "other weights");
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    other = constant();
    other.enc_offset_counts[j] += 1;
    EXPECT_EQ(offer(other), RAVENCAL_SUCCESS);
    expect_added({}, "another homing");
  }
}

TEST_F(HomingConstant, ThatIsNoNumberOrTooLargeIsRefused) {
  constexpr float kEndless = std::numeric_limits<float>::infinity();
  for (const float wrong : {std::numeric_limits<float>::quiet_NaN(), kEndless, -kEndless, 0.201F}) {
    EXPECT_EQ(offer(constant({0.0F, wrong, 0.0F})), RAVENCAL_ERROR_ARGUMENT) << wrong;
  }
  ravencal_homing_constant shorter = constant();
  shorter.struct_size -= 1;
  EXPECT_EQ(offer(shorter), RAVENCAL_ERROR_ARGUMENT);
  EXPECT_EQ(rig.api().set_homing_constant(nullptr, &shorter), RAVENCAL_ERROR_ARGUMENT);
  arm();
  expect_added({}, "nothing was taken");
}

TEST_F(HomingConstant, NeverLeadsBeyondTheLargestCorrection) {
  arm();
  ASSERT_EQ(offer(constant({0.2F, -0.2F, 0.02F})), RAVENCAL_SUCCESS);
  for (int i = 0; i < 3000; ++i) {
    if (i == 1500) rig.set_pedal(true);
    rig.tick();
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      ASSERT_LE(std::fabs(rig.output.correction_ji[j]), rig.config.max_correction_ji[j]);
    }
  }
  EXPECT_EQ(std::fabs(rig.output.correction_ji[1]), rig.config.max_correction_ji[1]);
}

// The cap by the weights: the mean and four deviations of their training's errors.
TEST_F(HomingConstant, BeyondTheCapOfTheWeightsIsIgnored) {
  Rig capped([](ravencal_config& config) { config.cap_deviations = 4.0F; });
  capped.load(make_model(16, {}));
  capped.enable();
  ASSERT_TRUE(capped.tick_until(RAVENCAL_STATE_ACTIVE));
  ravencal_homing_constant made = constant({0.04F, 0.0F, 0.0F});  // cap of joint 1: 0.036 rad
  ASSERT_EQ(capped.api().set_homing_constant(capped.instance.get(), &made), RAVENCAL_SUCCESS);
  for (int i = 0; i < 1500; ++i) capped.tick();
  EXPECT_NEAR(capped.output.correction_ji[0], capped.output.predicted_ji[0], 1e-6);
}

TEST_F(HomingConstant, LeavesTheRobotsOwnJointsWhereNothingIsApplied) {
  ASSERT_EQ(offer(constant()), RAVENCAL_SUCCESS);
  const auto expect_own = [&] {
    for (int i = 0; i < 500; ++i) {
      rig.tick();
      ASSERT_EQ(
          std::memcmp(rig.output.jpos_ji, rig.state.arm[0].jpos_ji, sizeof rig.output.jpos_ji), 0);
    }
  };
  expect_own();  // OFF
  rig.api().set_mode(rig.instance.get(), RAVENCAL_MODE_SHADOW);
  expect_own();
  EXPECT_NEAR(rig.output.would_be_ji[1], rig.output.predicted_ji[1] + kConstant_ji[1], 1e-6);
  rig.api().set_mode(rig.instance.get(), RAVENCAL_MODE_ARM);
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  expect_added(kConstant_ji, "armed");
  rig.enable(false);
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_OFF));
  expect_own();
}

TEST_F(HomingConstant, IsAppliedByTheShareAndStaysInADoubt) {
  arm();
  ASSERT_EQ(offer(constant()), RAVENCAL_SUCCESS);
  expect_added(kConstant_ji, "taken");
  const ravencal_info info = rig.instance.info();
  rig.state.arm[0].jpos_ji[0] = 100.0F;  // out of the trained range
  run(3000);
  ASSERT_EQ(rig.output.state, RAVENCAL_STATE_CONSTANT);
  for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
    // A doubt never adds to a correction.
    const float wanted_ji = info.constant_ji[j] + kConstant_ji[j];
    EXPECT_LE(std::fabs(rig.output.correction_ji[j]), std::fabs(wanted_ji) + 1e-6F) << j;
  }
  EXPECT_NEAR(rig.output.correction_ji[1], info.constant_ji[1] + kConstant_ji[1], 5e-3);

  rig.state.arm[0].jpos_ji[0] = healthy_state().arm[0].jpos_ji[0];
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  rig.api().set_share(rig.instance.get(), 0.5F, 2);
  run(1500);
  EXPECT_NEAR(rig.output.correction_ji[1], 0.5F * (rig.output.predicted_ji[1] + kConstant_ji[1]),
              1e-6);
  EXPECT_EQ(rig.output.correction_ji[0], 0.0F);
}

TEST_F(HomingConstant, EndsWithItsWeightsWithoutAStep) {
  arm();
  ASSERT_EQ(offer(constant()), RAVENCAL_SUCCESS);
  expect_added(kConstant_ji, "taken");
  rig.set_pedal(true);
  const auto before = std::to_array(rig.output.correction_ji);
  rig.load(make_model(16, {}, 2));
  for (int i = 0; i < 500; ++i) {
    rig.tick();
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      ASSERT_NEAR(rig.output.correction_ji[j], before[j], 1e-7) << "the pedal is down";
    }
  }
  rig.set_pedal(false);
  expect_added({}, "other weights");
}

TEST_F(HomingConstant, IsTakenAwayByNull) {
  arm();
  ASSERT_EQ(offer(constant()), RAVENCAL_SUCCESS);
  expect_added(kConstant_ji, "taken");
  rig.set_pedal(true);
  const auto before = std::to_array(rig.output.correction_ji);
  ASSERT_EQ(rig.api().set_homing_constant(rig.instance.get(), nullptr), RAVENCAL_SUCCESS);
  run(100);
  EXPECT_EQ(std::to_array(rig.output.correction_ji), before) << "the pedal is down";
  rig.set_pedal(false);
  expect_added({}, "ended");
}

}  // namespace
}  // namespace ravencal::test
