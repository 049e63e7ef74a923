// SPDX-License-Identifier: Apache-2.0
//
// Clients that command the arm in the very cycle in which its motors begin to follow: lines that
// began with the request to press, poses held from before, increments of teleoperation. A command
// says nothing about the correction, however far it goes.
#include <algorithm>
#include <cmath>

#include "unit/integration_pair.hpp"

namespace ravencal::test {
namespace {

constexpr std::array<double, 3> kTolerance = {0.02 * Added::kDeg, 0.02 * Added::kDeg, 2e-5};

class IntegrationClient : public Integration {
 protected:
  [[nodiscard]] Pair pair(bool in_shadow = false) {
    controller_setup with = setup(CONTROLLER_WITH);
    with.weights = offsets.c_str();
    with.in_shadow = in_shadow ? 1 : 0;
    Pair both = {api, with, setup(CONTROLLER_WITHOUT, false)};
    both.home();
    both.run(kPedalUp, 1000);
    return both;
  }
  [[nodiscard]] bool is_crtk() const { return std::string(api.branch) == "crtk"; }
  [[nodiscard]] std::array<int, 3> tip(const Controller& controller) const {
    std::array<int, 3> position_um{};
    api.tip(controller.get(), position_um.data());
    return position_um;
  }
  [[nodiscard]] std::array<float, 3> motors(const Controller& controller) const {
    std::array<float, 3> motor_rad{};
    api.true_motors(controller.get(), motor_rad.data());
    return motor_rad;
  }

  /// A client of each controller moves its arm's tip from where it is, by so much per cycle, from
  /// the request to press on; the PLC follows that later. Returns where the one with the plugin
  /// ends.
  std::array<int, 3> line_from_press(Pair& both, std::array<int, 3> step_um, int plc_ms,
                                     int cycles) {
    std::array<std::array<int, 3>, 2> from = {tip(both.with()), tip(both.without())};
    both.press(true);
    for (int i = 0; i < plc_ms + cycles; ++i) {
      int which = 0;
      both.each([&](controller* c) {
        auto& position_um = from[static_cast<std::size_t>(which++)];
        for (std::size_t k = 0; k < 3; ++k) position_um[k] += step_um[k];
        api.command_pose(c, position_um.data());
      });
      both.run(i < plc_ms ? kPedalUp : kPedalDown, 1);
    }
    return from[0];
  }
  void release(Pair& both) {
    both.each([&](controller* c) { api.command_pose(c, nullptr); });
    both.press(false);
    both.run(kPedalUp, 300);
  }
  /// The press of each branch whose client commands in its first cycle: CRTK, a line begun at the
  /// request; main, an increment of teleoperation of 0.47 mm.
  void press_with_a_command(Pair& both) {
    if (is_crtk()) {
      line_from_press(both, {40, 0, 0}, 100, 200);
    } else {
      const std::array<int, 3> step_um = {470, 0, 0};
      const std::array<int, 3> none{};
      both.press(true);
      both.each([&](controller* c) { api.command_tip(c, step_um.data()); });
      both.run(kPedalDown, 4);  // debounced: the first cycle of the press is the fourth
      both.each([&](controller* c) { api.command_tip(c, none.data()); });
      both.run(kPedalDown, 200);
    }
    release(both);
  }
  void expect_nothing_applied(Pair& both) {
    for (std::size_t j = 0; j < 3; ++j) {
      EXPECT_EQ(both.with().output().correction_ji[j], 0.0F) << j;
      EXPECT_EQ(motors(both.with())[j], motors(both.without())[j]) << j;
    }
  }

  const std::filesystem::path offsets =
      write_weights(model_of_offsets(GetParam().green != 0), "client_offsets");
};

/// The main branch takes no absolute positions and no joint commands.
class IntegrationCrtkClient : public IntegrationClient {};

INSTANTIATE_TEST_SUITE_P(EveryBranch, IntegrationClient, every_branch(), name_of_case);
INSTANTIATE_TEST_SUITE_P(CrtkBranch, IntegrationCrtkClient,
                         ::testing::Values(Case{"crtk_98_gold", controller_crtk_98, 0},
                                           Case{"crtk_17_green", controller_crtk_17, 1}),
                         name_of_case);

TEST_P(IntegrationClient, FindsNoCorrectionInOffAfterTwelvePresses) {
  Pair both = pair();
  api.enable(both.with().get(), 0);
  both.run(kPedalUp, 1000);
  ASSERT_EQ(both.with().output().state, RAVENCAL_STATE_OFF);
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(i);
    press_with_a_command(both);
    expect_nothing_applied(both);
  }
  both.run(kEmergencyStop, 2000);
  expect_nothing_applied(both);
  both.home();
  expect_nothing_applied(both);
}

TEST_P(IntegrationClient, FindsNoCorrectionInShadow) {
  Pair both = pair(true);
  ASSERT_EQ(both.with().output().state, RAVENCAL_STATE_SHADOW);
  ASSERT_EQ(both.with().output().would_be_state, RAVENCAL_STATE_ACTIVE);
  for (int i = 0; i < 3; ++i) {
    SCOPED_TRACE(i);
    press_with_a_command(both);
    expect_nothing_applied(both);
    EXPECT_NEAR(both.with().output().would_be_ji[1], -0.120, 0.02) << "shown all the same";
  }
}

TEST_P(IntegrationCrtkClient, ALineBegunWithTheRequestToPressMovesNoCorrection) {
  for (const int plc_ms : {1, 20, 50, 100, 200}) {
    SCOPED_TRACE(std::to_string(plc_ms) + " ms");
    Pair both = pair();
    ASSERT_EQ(both.with().output().state, RAVENCAL_STATE_ACTIVE);
    const std::array<int, 3> goal_um = line_from_press(both, {10, 10, 0}, plc_ms, 1000);
    both.run(kPedalDown, 500);
    const ravencal_output& output = both.with().output();
    EXPECT_EQ(both.with().output().doubts & RAVENCAL_DOUBT_PRESS, 0U);
    for (std::size_t j = 0; j < 3; ++j) {
      EXPECT_NEAR(output.correction_ji[j], output.predicted_ji[j], kTolerance[j]) << j;
      EXPECT_NEAR(tip(both.with())[j], goal_um[j], 50) << "it arrives";
    }
  }
}

TEST_P(IntegrationClient, AnIncrementInThePressesFirstCycleMovesTheArmAsWithoutThePlugin) {
  Pair both = pair();
  ASSERT_EQ(both.with().output().state, RAVENCAL_STATE_ACTIVE);
  const auto corrected = std::to_array(both.with().output().correction_ji);
  const std::array<int, 3> before_um = tip(both.with());
  const std::array<int, 3> before_without_um = tip(both.without());
  const std::array<int, 3> step_um = {470, -300, 0};
  const std::array<int, 3> none{};
  both.press(true);
  both.run(kPedalDown, 3);
  both.each([&](controller* c) { api.command_tip(c, step_um.data()); });
  both.run(kPedalDown, 1);
  both.each([&](controller* c) { api.command_tip(c, none.data()); });
  both.run(kPedalDown, 500);
  EXPECT_EQ(both.with().output().doubts & RAVENCAL_DOUBT_PRESS, 0U);
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_NEAR(both.with().output().correction_ji[j], corrected[j], kTolerance[j]) << j;
    EXPECT_NEAR(tip(both.with())[j] - before_um[j], tip(both.without())[j] - before_without_um[j],
                20)
        << j;
  }
}

TEST_P(IntegrationCrtkClient, AHeldPoseIsGoneToAndNotTakenForACorrection) {
  Pair both = pair();
  const std::array<int, 3> from_um = tip(both.with());
  const auto corrected = std::to_array(both.with().output().correction_ji);
  const std::array<float, 3> before_rad = motors(both.with());
  const std::array<int, 3> held_um = {from_um[0] + 4000, from_um[1] - 3000, from_um[2] + 3500};
  both.each([&](controller* c) { api.command_pose(c, held_um.data()); });
  both.press(true);
  both.run(kPedalUp, 100);
  both.run(kPedalDown, 2000);
  const std::array<float, 3> after_rad = motors(both.with());
  double moved_ji = 0.0;
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_NEAR(tip(both.with())[j], held_um[j], 50) << j;
    EXPECT_NEAR(both.with().output().correction_ji[j], corrected[j], 2e-3) << j;
    moved_ji = std::max(
        moved_ji, std::fabs(static_cast<double>(after_rad[j] - before_rad[j])) / kReduction[j]);
  }
  EXPECT_GT(moved_ji, 1.0 * Added::kDeg) << "the arm went there";
}

TEST_P(IntegrationCrtkClient, ACommandBeyondALimitOfTheMotorSideEndsThere) {
  // Corrected elbow at 134.4 deg, within the controller's 135 deg: 141.3 deg at the motor side.
  Pair both = pair();
  both.move_by_hand(0, {0.0F, 0.6F, 0.0F});  // from 90 to 124.4 deg
  both.run(kPedalUp, 1000);
  ASSERT_NEAR(both.with().output().correction_ji[1], -0.12, 0.01);
  both.press(true);
  both.run(kPedalUp, 20);
  both.run(kPedalDown, 100);
  const auto elbow_ji = [&](const Controller& controller) {
    std::array<float, 3> jpos{}, jpos_d{};
    api.joints(controller.get(), jpos.data(), jpos_d.data());
    const float correction_ji =
        &controller == &both.with() ? controller.output().correction_ji[1] : 0;
    return static_cast<double>(jpos[1] - correction_ji);
  };
  both.stream(1, {0.0F, 2e-4F, 0.0F});
  std::uint32_t doubts = 0;
  double highest_ji = 0.0;
  for (int i = 0; i < 3000; ++i) {
    both.run(kPedalDown, 1);
    doubts |= both.with().output().doubts;
    highest_ji = std::max(highest_ji, elbow_ji(both.with()));
  }
  EXPECT_LE(highest_ji, 2.356194490 + kTolerance[1]);
  EXPECT_GT(highest_ji, 2.35);
  EXPECT_NE(doubts & RAVENCAL_DOUBT_LIMIT, 0U);
  EXPECT_EQ(doubts & RAVENCAL_DOUBT_PRESS, 0U);
}

TEST_P(IntegrationClient, AnEmergencyStopLeavesWhatWasArmedInShadow) {
  Pair both = pair(true);
  api.enable(both.with().get(), 1);
  both.run(kPedalUp, 1000);
  ASSERT_EQ(both.with().output().state, RAVENCAL_STATE_ACTIVE);
  both.run(kEmergencyStop, 1000);
  EXPECT_EQ(both.with().output().state, RAVENCAL_STATE_SHADOW);
  both.home();
  both.run(kPedalUp, 1000);
  EXPECT_EQ(both.with().output().state, RAVENCAL_STATE_SHADOW);
  expect_nothing_applied(both);
}

TEST_P(IntegrationClient, PublishesJointsWithTheShareThatIsApplied) {
  Pair both = pair();
  api.set_share(both.with().get(), 0.1F, 2);  // a tenth, of the elbow alone
  both.run(kPedalUp, 1000);
  const ravencal_output& output = both.with().output();
  EXPECT_EQ(output.state, RAVENCAL_STATE_ACTIVE);
  EXPECT_EQ(output.correction_ji[0], 0.0F);
  EXPECT_EQ(output.correction_ji[2], 0.0F);
  EXPECT_NEAR(output.correction_ji[1], 0.1F * output.predicted_ji[1], 1e-7);
  std::array<float, 3> jpos{}, jpos_d{};
  api.joints(both.with().get(), jpos.data(), jpos_d.data());
  for (std::size_t j = 0; j < 3; ++j) EXPECT_EQ(jpos[j], output.jpos_ji[j]) << j;
  both.press(true);
  both.run(kPedalUp, 20);
  const Added added = both.watch(1000);
  EXPECT_TRUE(added.is_nothing()) << added;
}

}  // namespace
}  // namespace ravencal::test
