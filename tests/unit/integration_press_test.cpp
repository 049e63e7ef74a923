// SPDX-License-Identifier: Apache-2.0
//
// A press of the pedal moves the arm with the plugin as it does without it, also where the
// controller leaves its desired joints as they were.
#include <cmath>

#include "unit/integration_pair.hpp"

namespace ravencal::test {
namespace {

class IntegrationPress : public Integration {
 protected:
  [[nodiscard]] Pair pair(int fault = 0) {
    controller_setup with = setup(CONTROLLER_WITH);
    with.fault = fault;
    with.weights = offsets.c_str();
    return {api, with, setup(CONTROLLER_WITHOUT, false)};
  }
  [[nodiscard]] bool is_crtk() const { return std::string(api.branch) == "crtk"; }

  const std::filesystem::path offsets =
      write_weights(model_of_offsets(GetParam().green != 0), "integration_offsets");
};

INSTANTIATE_TEST_SUITE_P(EveryBranch, IntegrationPress, every_branch(), name_of_case);

void expect_nothing(const Added& added) { EXPECT_TRUE(added.is_nothing()) << added; }

TEST_P(IntegrationPress, AfterAnEmergencyStopInJointModeGoesBackToTheSameJoints) {
  if (!is_crtk()) GTEST_SKIP() << "the main branch has no joint mode";
  for (const int streams : {1, 2}) {               // to the calibrated arm, to the other one
    for (const int plc_ms : {1, 3, 8, 20, 200}) {  // with the pedal up, before it is down
      SCOPED_TRACE(std::to_string(streams) + ", " + std::to_string(plc_ms) + " ms");
      Pair both = pair();
      both.home();
      both.run(kPedalUp, 1000);
      both.press(true);
      both.stream(streams);
      both.run(kPedalDown, 300);
      both.run(kEmergencyStop, 1500);
      both.run(kInit, 30);
      both.run(kPedalUp, plc_ms);
      expect_nothing(both.watch(1000));
    }
  }
}

TEST_P(IntegrationPress, DuringAFadeWhileAClientStreamsAddsNothingAtAnyLatencyOfThePlc) {
  if (!is_crtk()) GTEST_SKIP() << "the main branch has no joint mode";
  for (const int on : {1, 0}) {
    for (const int latency_ms : {1, 8, 100, 200}) {
      SCOPED_TRACE(std::to_string(on) + ", " + std::to_string(latency_ms) + " ms");
      Pair both = pair();
      api.enable(both.with().get(), 1 - on);
      both.home();
      both.run(kPedalUp, 1000);
      api.enable(both.with().get(), on);
      both.run(kPedalUp, 150);
      both.stream(1);
      both.press(true);
      both.run(kPedalUp, latency_ms);
      expect_nothing(both.watch(1000));
    }
  }
}

TEST_P(IntegrationPress, AfterTheCorrectionMovedWithACommandGoesBackToTheSameJoints) {
  if (!is_crtk()) GTEST_SKIP() << "the main branch has no joint mode";
  Pair both = pair();
  api.enable(both.with().get(), 0);
  both.home();
  both.run(kPedalUp, 1000);
  api.enable(both.with().get(), 1);
  both.run(kPedalUp, 150);  // in the middle of the fade: the rest of it is blended in
  both.press(true);
  both.run(kPedalUp, 8);
  both.run(kPedalDown, 200);
  const float before_ji = both.with().output().correction_ji[1];
  both.stream(1, {2e-4F, -2e-4F, 2e-5F});
  both.run(kPedalDown, 1000);
  EXPECT_GT(std::fabs(both.with().output().correction_ji[1] - before_ji), 0.1 * Added::kDeg);
  both.stream(1);
  both.run(kPedalDown, 500);
  both.run(kEmergencyStop, 1500);
  both.move_by_hand(0, {0.003F, 0.003F, 0.0003F});  // as the weight of an arm does
  both.run(kInit, 30);
  both.run(kPedalUp, 3);
  expect_nothing(both.watch(1000));
  EXPECT_EQ(both.with().output().doubts & RAVENCAL_DOUBT_PRESS, 0U);
}

TEST_P(IntegrationPress, WithAWithdrawnToolAddsNothing) {
  for (const int other : {0, 1}) {
    SCOPED_TRACE(other);
    Pair both = pair();
    api.enable(both.with().get(), 0);
    both.home();
    both.run(kPedalUp, 500);
    both.move_by_hand(other, {0.0F, 0.0F, 0.07F});  // to the remote centre
    both.run(kPedalUp, 100);
    api.enable(both.with().get(), 1);
    both.run(kPedalUp, 1000);
    both.press(true);
    expect_nothing(both.watch(1000));
  }
}

TEST_P(IntegrationPress, BesideTheRemoteCentreAddsNothing) {
  // Just outside of where inverse kinematics fail, where a correction would lead into it.
  Pair both = pair();
  both.home();
  both.run(kPedalUp, 1000);
  both.move_by_hand(0, {0.0F, 0.0F, 0.052F});
  both.run(kPedalUp, 500);
  both.press(true);
  expect_nothing(both.watch(1000));
}

TEST_P(IntegrationPress, MovedByHandPastALimitOfTheCorrectionAddsNothing) {
  // As far as the correction gives way, the corrected joint stands still at the boundary while the
  // measured one goes on: the controller writes the desired joint that it had. Then inverse
  // kinematics fail, and it keeps it.
  Pair both = pair();
  both.home();
  both.run(kPedalUp, 1000);
  constexpr int kCycles = 3000;
  for (int i = 0; i < kCycles; ++i) {
    both.move_by_hand(0, {0.0F, 0.0F, 0.07F / kCycles});
    both.run(kPedalUp, 1);
  }
  both.run(kPedalUp, 1000);
  both.press(true);
  expect_nothing(both.watch(1000));
  EXPECT_EQ(both.with().output().doubts & RAVENCAL_DOUBT_PRESS, 0U);
}

TEST_P(IntegrationPress, NearALimitOfTheJointsAddsNothing) {
  struct Place {
    const char* name;
    std::array<float, 3> by_ji;  // from home: 30 deg, 90 deg, 0.4 m
  };
  for (const Place& place : {Place{"elbow at 47.8 deg", {0.0F, -0.7365F, 0.0F}},
                             Place{"shoulder at 89.5 deg", {1.0384F, 0.0F, 0.0F}},
                             Place{"insertion at 0.555 m", {0.0F, 0.0F, 0.155F}}}) {
    for (const int fault : {0, SETTINGS_WIDE_LIMITS}) {
      SCOPED_TRACE(std::string(place.name) + ", fault " + std::to_string(fault));
      Pair both = pair(fault);
      both.home();
      both.run(kPedalUp, 500);
      both.move_by_hand(0, place.by_ji);
      both.run(kPedalUp, 1000);
      const std::uint32_t limit = both.with().output().doubts & RAVENCAL_DOUBT_LIMIT;
      EXPECT_EQ(limit != 0, fault == 0);
      both.press(true);
      Added added = both.watch(1000);
      // With limits that are not the controller's, the last line holds: the command, which was at
      // the limit while no motor followed it, comes back to the motors.
      if (fault != 0) added.command_step_counts = {};
      expect_nothing(added);
      const std::uint32_t press = both.with().output().doubts & RAVENCAL_DOUBT_PRESS;
      EXPECT_EQ(press != 0, fault != 0);
    }
  }
}

TEST_P(IntegrationPress, OpeningAnOpenAdapterIsRefusedAndMovesNothing) {
  Pair both = pair();
  both.home();
  both.run(kPedalUp, 1000);
  both.press(true);
  both.run(kPedalDown, 300);
  EXPECT_EQ(api.open_again(both.with().get()), 0);
  EXPECT_NE(std::string(api.error(both.with().get())).find("is open"), std::string::npos);
  expect_nothing(both.watch(1000));
}

TEST_P(IntegrationPress, DropsTheCorrectionAtOnceInInit) {
  Pair both = pair();
  both.home();
  both.run(kPedalUp, 1000);
  ASSERT_EQ(both.with().output().state, RAVENCAL_STATE_ACTIVE);
  both.run(kInit, 5);
  for (const float correction : both.with().output().correction_ji) EXPECT_EQ(correction, 0.0F);
  both.press(true);
  expect_nothing(both.watch(1000));
}

}  // namespace
}  // namespace ravencal::test
