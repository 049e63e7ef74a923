// SPDX-License-Identifier: Apache-2.0
//
// What the adapter does to the controller: the correction both ways, no motion that nobody
// commands, and the controller bit for bit where it is undone.
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "plugin_host/robot_state.hpp"
#include "unit/integration_rig.hpp"

namespace ravencal::test {
namespace {

class IntegrationMotion : public Integration {};

INSTANTIATE_TEST_SUITE_P(EveryBranch, IntegrationMotion, every_branch(), name_of_case);

TEST_P(IntegrationMotion, DropsTheCorrectionInASoftEmergencyStopOnEitherArm) {
  Controller controller = made(CONTROLLER_WITH);
  go_active(controller);
  api.soft_stop(controller.get());
  const float frozen = controller.output().correction_ji[1];
  controller.run(kPedalDown, 300);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_FADING_OUT);
  EXPECT_EQ(controller.output().correction_ji[1], frozen) << "the pedal is still down";
  controller.run(kEmergencyStop, 1000);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_ARMED);
  controller.run(kPedalUp, 1000);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_ARMED) << "until it is homed again";
  controller.home();
  controller.run(kPedalUp, 1000);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_ACTIVE);
}

TEST_P(IntegrationMotion, LeavesTheUnhomingToTheController) {
  for (const bool with_plugin : {false, true}) {
    Controller controller = made(with_plugin ? CONTROLLER_WITH : CONTROLLER_WITHOUT, with_plugin);
    controller.run(kEmergencyStop, 20);
    controller.home();
    controller.run(kPedalUp, 500);
    EXPECT_EQ(api.is_homed(controller.get()), 1);
    api.unhome(controller.get());
    controller.run(kPedalUp, 2000);
    if (std::string(api.branch) != "crtk") continue;
    EXPECT_EQ(api.is_homed(controller.get()), 0);
    if (with_plugin) {
      EXPECT_EQ(controller.output().state, RAVENCAL_STATE_ARMED);
    }
  }
}

/// Largest change of the motor commands per cycle, and where the joints went meanwhile.
struct Motion {
  std::array<double, 3> largest_step_rad{};
  std::array<double, 3> moved_ji{};
};

Motion observe_motion(const controller_api& api, Controller& controller, int cycles) {
  Motion motion;
  std::array<float, 3> mpos{};
  std::array<float, 3> before{};
  api.motors(controller.get(), mpos.data(), before.data());
  const std::array<float, 3> start = mpos;
  for (int i = 0; i < cycles; ++i) {
    controller.run(kPedalDown, 1);
    std::array<float, 3> now{};
    api.motors(controller.get(), mpos.data(), now.data());
    for (std::size_t j = 0; j < 3; ++j) {
      const double step = std::fabs(static_cast<double>(now[j] - before[j]));
      motion.largest_step_rad[j] = std::max(motion.largest_step_rad[j], step);
    }
    before = now;
  }
  for (std::size_t j = 0; j < 3; ++j) {
    motion.moved_ji[j] = std::fabs(static_cast<double>(mpos[j] - start[j])) / kReduction[j];
  }
  return motion;
}

TEST_P(IntegrationMotion, MovesNoMotorThatNobodyCommandsWhateverBecomesOfTheCorrection) {
  const auto other = write_weights(
      [&] {
        model::CalibrationModel model = model_for_home(GetParam().green != 0);
        model.output.mean = Eigen::Vector3d(0.05, 0.03, -0.003);
        return model;
      }(),
      "integration_other");
  const std::vector<std::pair<const char*, std::function<void(Controller&)>>> transitions = {
      {"nothing", [](Controller&) {}},
      {"disabled", [&](Controller& c) { api.enable(c.get(), 0); }},
      {"other weights", [&](Controller& c) { EXPECT_EQ(api.load(c.get(), other.c_str()), 1); }},
      {"soft stop", [&](Controller& c) { api.soft_stop(c.get()); }}};
  for (const auto& [name, act] : transitions) {
    Controller controller = made(CONTROLLER_WITH);
    api.command(controller.get(), 0);
    controller.run(kEmergencyStop, 20);
    controller.home();
    controller.run(kPedalUp, 1000);
    controller.run(kPedalDown, 2000);  // friction and weight have settled
    act(controller);
    const Motion motion = observe_motion(api, controller, 3000);
    for (std::size_t j = 0; j < 3; ++j) {
      EXPECT_LT(motion.largest_step_rad[j], kRadPerCount) << name << ", joint " << j + 1;
      EXPECT_LT(motion.moved_ji[j], 2.0 * kRadPerCount / kReduction[j]) << name << ", " << j + 1;
    }
  }
  // A pedal pressed while the correction fades in.
  Controller early = made(CONTROLLER_WITH);
  api.command(early.get(), 0);
  early.run(kEmergencyStop, 20);
  early.home();
  early.run(kPedalUp, 115);
  ASSERT_EQ(early.output().state, RAVENCAL_STATE_FADING_IN);
  early.run(kPedalDown, 500);
  EXPECT_NE(early.output().offset_ji[1], 0.0F);
  const Motion motion = observe_motion(api, early, 3000);
  for (std::size_t j = 0; j < 3; ++j) EXPECT_LT(motion.largest_step_rad[j], kRadPerCount);
}

TEST_P(IntegrationMotion, BlendsAnOffsetAwayWithTheMotionThatTheOperatorCommands) {
  Controller early = made(CONTROLLER_WITH);
  api.command(early.get(), 0);
  early.run(kEmergencyStop, 20);
  early.home();
  early.run(kPedalUp, 115);
  early.run(kPedalDown, 500);
  const float offset = std::fabs(early.output().offset_ji[1]);
  ASSERT_GT(offset, 0.001F);
  early.run(kPedalDown, 1000);
  EXPECT_EQ(std::fabs(early.output().offset_ji[1]), offset) << "nobody moves the arm";
  api.command(early.get(), 1);
  early.run(kPedalDown, 20000);
  EXPECT_LT(std::fabs(early.output().offset_ji[1]), 0.2F * offset);
}

TEST_P(IntegrationMotion, CorrectsTheCalibratedArmOnlyAndFromHomingToEStop) {
  Controller with = made(CONTROLLER_WITH);
  with.run(kEmergencyStop, 20);
  EXPECT_EQ(with.output().state, RAVENCAL_STATE_ARMED);
  with.home();
  for (const float correction : with.output().correction_ji) EXPECT_EQ(correction, 0.0F);
  with.run(kPedalUp, 3000);
  EXPECT_EQ(with.output().state, RAVENCAL_STATE_ACTIVE);
  with.run(kPedalDown, 3000);  // what it held when the pedal moved, the motion has taken up
  EXPECT_EQ(with.output().state, RAVENCAL_STATE_ACTIVE);
  std::array<float, 3> jpos{};
  std::array<float, 3> jpos_d{};
  api.joints(with.get(), jpos.data(), jpos_d.data());
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_EQ(jpos[j], with.output().jpos_ji[j]) << "written back";
    EXPECT_NE(with.output().correction_ji[j], 0.0F);
  }
  EXPECT_NEAR(with.output().correction_ji[1], -0.03, 0.005);

  with.run(kEmergencyStop, 1000);
  EXPECT_EQ(with.output().state, RAVENCAL_STATE_ARMED);
  for (const float correction : with.output().correction_ji) EXPECT_EQ(correction, 0.0F);
  with.home();
  with.run(kPedalUp, 3000);
  EXPECT_EQ(with.output().state, RAVENCAL_STATE_ACTIVE) << "again, after re-homing";
}

TEST_P(IntegrationMotion, LeavesTheOtherArmAlone) {
  Controller with = made(CONTROLLER_WITH);
  Controller without = made(CONTROLLER_WITHOUT, false);
  for (Controller* controller : {&with, &without}) {
    api.command(controller->get(), 0);  // the same tip is other tool joints
    controller->run(kEmergencyStop, 20);
    controller->home();
    controller->run(kPedalUp, 3000);
    controller->run(kPedalDown, 500);
  }
  plugin_host::CatalogueValues a{};
  plugin_host::CatalogueValues b{};
  api.published(with.get(), a.data());
  api.published(without.get(), b.data());
  const std::size_t own = GetParam().green != 0 ? 8 : 0;
  const std::size_t other = 8 - own;
  for (std::size_t j = 0; j < 8; ++j) {
    for (const std::size_t field : {1U, 70U, 86U, 102U, 118U, 166U, 182U}) {
      EXPECT_EQ(a[field + other + j], b[field + other + j]) << field << " " << j;
    }
    EXPECT_EQ(a[1 + own + j] != b[1 + own + j], j < 3) << "joints 1 to 3 differ, the tool does not";
  }
}

/// Largest distance between desired and actual motors while the pedal is up: the step to come.
std::array<double, 3> motor_error_while_pedal_is_up(const controller_api& api, Controller& c) {
  std::array<double, 3> worst{};
  c.run(kPedalUp, 10);  // until the controller believes its PLC
  for (int i = 0; i < 200; ++i) {
    c.run(kPedalUp, 1);
    std::array<float, 3> mpos{};
    std::array<float, 3> mpos_d{};
    api.motors(c.get(), mpos.data(), mpos_d.data());
    for (std::size_t j = 0; j < 3; ++j) {
      worst[j] = std::max(worst[j], std::fabs(static_cast<double>(mpos_d[j] - mpos[j])));
    }
  }
  return worst;
}

TEST_P(IntegrationMotion, ReseedsDesiredFromActualWithinTheRoundingOfThePose) {
  Controller both_ways = made(CONTROLLER_WITH);
  go_active(both_ways);
  for (const double error : motor_error_while_pedal_is_up(api, both_ways)) {
    EXPECT_LT(error, 2.0 * kRadPerCount);
  }
  // The same controller without the lines in the inverse path, which shows why the pair is needed.
  Controller one_way = made(CONTROLLER_ONE_WAY);
  one_way.run(kEmergencyStop, 20);
  one_way.home();
  one_way.run(kPedalUp, 3000);
  ASSERT_EQ(one_way.output().state, RAVENCAL_STATE_ACTIVE);
  const auto alarm = motor_error_while_pedal_is_up(api, one_way);
  EXPECT_GT(alarm[0], 1000.0 * kRadPerCount);
}

TEST_P(IntegrationMotion, IsBitForBitTheControllerBeforeWhereItIsUndoneOffOrInShadow) {
  Controller before = made(CONTROLLER_WITHOUT, false);
  Controller not_opened = made(CONTROLLER_WITH, false);
  Controller off = made(CONTROLLER_WITH);
  api.enable(off.get(), 0);
  const controller_setup wrong{CONTROLLER_WITH,
                               "/nonexistent/plugin.so",
                               nullptr,
                               nullptr,
                               GetParam().green,
                               0,
                               0,
                               0,
                               0,
                               500000000,
                               0};
  controller_setup shown = setup(CONTROLLER_WITH);
  shown.in_shadow = 1;
  Controller shadow(api, shown);
  Controller refused(api, wrong);
  EXPECT_NE(std::string(api.error(refused.get())).find("cannot be loaded"), std::string::npos);
  const controller_setup damaged{CONTROLLER_WITH,
                                 RAVENCAL_PLUGIN_PATH,
                                 "/nonexistent.blob",
                                 nullptr,
                                 GetParam().green,
                                 0,
                                 0,
                                 0,
                                 0,
                                 500000000,
                                 0};
  Controller without_weights(api, damaged);
  EXPECT_NE(std::string(api.error(without_weights.get())).find("/nonexistent.blob"),
            std::string::npos);
  const auto all = [&](const std::function<void(Controller&)>& act) {
    for (Controller* c : {&before, &not_opened, &off, &shadow, &refused, &without_weights}) act(*c);
    const std::string wanted = before.bytes();
    EXPECT_TRUE(not_opened.bytes() == wanted);
    EXPECT_TRUE(off.bytes() == wanted);
    EXPECT_TRUE(shadow.bytes() == wanted);
    EXPECT_TRUE(refused.bytes() == wanted);
    EXPECT_TRUE(without_weights.bytes() == wanted);
  };
  for (int round = 0; round < 2; ++round) {
    for (int i = 0; i < 1000; ++i) all([](Controller& c) { c.run(kEmergencyStop, 1); });
    all([&](Controller& c) { api.begin_homing(c.get()); });
    for (int i = 0; i < 2500; ++i) all([](Controller& c) { c.run(kInit, 1); });
    for (int i = 0; i < 300; ++i) all([](Controller& c) { c.run(kPedalUp, 1); });
    for (int i = 0; i < 1000; ++i) all([](Controller& c) { c.run(kPedalDown, 1); });
    all([&](Controller& c) { round == 0 ? api.unhome(c.get()) : api.soft_stop(c.get()); });
    for (int i = 0; i < 100; ++i) all([](Controller& c) { c.run(kPedalDown, 1); });
  }
}

TEST_P(IntegrationMotion, TakesNewWeightsWhileItRunsAndKeepsTheOldOnesOnARefusal) {
  Controller controller = made(CONTROLLER_WITH);
  go_active(controller);
  EXPECT_EQ(api.load(controller.get(), "/nonexistent.blob"), 0);
  controller.run(kPedalDown, 10);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_ACTIVE);
  model::CalibrationModel model = model_for_home(GetParam().green != 0);
  model.output.mean = Eigen::Vector3d(0.03, -0.03, 0.002);
  EXPECT_EQ(api.load(controller.get(), write_weights(model, "integration_new").c_str()), 1);
  controller.run(kPedalDown, 100);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_FADING_IN) << "bumpless: by its motion";
  controller.run(kPedalUp, 1000);
  EXPECT_EQ(controller.output().state, RAVENCAL_STATE_ACTIVE);
  EXPECT_NEAR(controller.output().correction_ji[0], 0.03, 0.005);
}

}  // namespace
}  // namespace ravencal::test
