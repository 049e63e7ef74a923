// SPDX-License-Identifier: Apache-2.0
//
// What the operator asks for: OFF, SHADOW, ARM, a share of the correction, some joints alone; and
// the largest correction, by the weights' own training. Seen through the plugin's C ABI.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>

#include "core/run_level.hpp"
#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

class Mode : public ::testing::Test {
 protected:
  void SetUp() override { rig.load(make_model(16, {})); }

  void set(std::int32_t mode) {
    EXPECT_EQ(rig.api().set_mode(rig.instance.get(), mode), RAVENCAL_SUCCESS);
  }
  void expect_own_joints() {
    EXPECT_EQ(std::memcmp(rig.output.jpos_ji, rig.state.arm[0].jpos_ji, sizeof rig.output.jpos_ji),
              0);
    for (const float correction : rig.output.correction_ji) EXPECT_EQ(correction, 0.0F);
  }
  void expect_share(float share, std::array<bool, RAVENCAL_JOINTS> corrected) {
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      const float wanted = corrected[j] ? share * rig.output.predicted_ji[j] : 0.0F;
      EXPECT_NEAR(rig.output.correction_ji[j], wanted, 1e-7) << j;
      EXPECT_EQ(rig.output.jpos_ji[j], rig.state.arm[0].jpos_ji[j] + rig.output.correction_ji[j]);
    }
  }

  Rig rig{[](ravencal_config& config) { config.resume_after_stop = 0; }};
};

TEST_F(Mode, ShadowShowsWhatArmApplies) {
  Rig armed;
  armed.load(make_model(16, {}));
  armed.enable();
  set(RAVENCAL_MODE_SHADOW);
  for (int i = 0; i < 1000; ++i) {
    const bool is_down = i > 500;
    for (Rig* one : {&rig, &armed}) {
      one->state.runlevel = is_down ? core::kPedalDown : core::kPedalUp;
      one->state.arm[0].jpos_ji[0] = 0.3F + 1e-4F * static_cast<float>(i % 100);
      one->state.arm[0].jpos_d_ji[0] = one->state.arm[0].jpos_ji[0];
      one->tick();
    }
    expect_own_joints();
    ASSERT_EQ(rig.output.state, RAVENCAL_STATE_SHADOW);
    ASSERT_EQ(rig.output.would_be_state, armed.output.state) << i;
    ASSERT_EQ(rig.output.doubts, armed.output.doubts) << i;
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      // The rig publishes desired joints without a correction: what is applied adds to its motion.
      ASSERT_NEAR(rig.output.would_be_ji[j], armed.output.correction_ji[j], 2e-5) << i;
    }
  }
  EXPECT_NE(rig.output.would_be_ji[1], 0.0F);
  EXPECT_EQ(rig.instance.counters().ticks_in_state[RAVENCAL_STATE_SHADOW], 1000U);
}

TEST_F(Mode, GoesFromShadowToArmAndBackWithoutAStep) {
  set(RAVENCAL_MODE_SHADOW);
  for (int i = 0; i < 500; ++i) rig.tick();
  set(RAVENCAL_MODE_ARM);
  rig.tick();
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_ARMED) << "what was shown is not gone on from";
  expect_own_joints();
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  EXPECT_EQ(rig.output.would_be_ji[1], rig.output.correction_ji[1]);

  rig.set_pedal(true);
  const auto before = std::to_array(rig.output.correction_ji);
  set(RAVENCAL_MODE_SHADOW);
  for (int i = 0; i < 500; ++i) {
    rig.tick();
    ASSERT_EQ(rig.output.state, RAVENCAL_STATE_FADING_OUT) << "the pedal is down";
    for (std::size_t j = 0; j < RAVENCAL_JOINTS; ++j) {
      ASSERT_EQ(rig.output.correction_ji[j], before[j]);
    }
  }
  rig.state.runlevel = core::kPedalUp;
  float last = rig.output.correction_ji[1];
  while (rig.output.state != RAVENCAL_STATE_SHADOW) {
    rig.tick();
    ASSERT_LE(std::fabs(rig.output.correction_ji[1] - last),
              1.001e-3F * rig.config.slew_ji_per_s[1]);
    last = rig.output.correction_ji[1];
  }
  expect_own_joints();
}

TEST_F(Mode, ArmedIsShownAfterAnEmergencyStopUnlessTheSettingsSayOtherwise) {
  for (const std::uint32_t resumes : {0U, 1U}) {
    Rig one([&](ravencal_config& config) { config.resume_after_stop = resumes; });
    one.load(make_model(16, {}));
    one.state.runlevel = core::kEmergencyStop;
    for (int i = 0; i < 10; ++i) one.tick();
    one.enable();  // before the robot ever ran: that is no stop
    one.state.runlevel = core::kPedalUp;
    ASSERT_TRUE(one.tick_until(RAVENCAL_STATE_ACTIVE));
    one.state.runlevel = core::kEmergencyStop;
    for (int i = 0; i < 600; ++i) one.tick();
    for (const float correction : one.output.correction_ji) EXPECT_EQ(correction, 0.0F);
    one.state.runlevel = core::kPedalUp;
    for (int i = 0; i < 1000; ++i) one.tick();
    EXPECT_EQ(one.output.state, resumes != 0 ? RAVENCAL_STATE_ACTIVE : RAVENCAL_STATE_SHADOW);
    one.enable();
    EXPECT_TRUE(one.tick_until(RAVENCAL_STATE_ACTIVE)) << "armed again";
  }
}

TEST_F(Mode, LatchesAFaultInShadowToo) {
  rig.load(make_model_with_a_flaw());
  set(RAVENCAL_MODE_SHADOW);
  for (int i = 0; i < 500; ++i) rig.tick();
  provoke_flaw(rig.state);
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_FAULT));
  expect_own_joints();
  rig.state = healthy_state(rig.state.t_ns);
  for (const std::int32_t mode : {RAVENCAL_MODE_ARM, RAVENCAL_MODE_SHADOW, RAVENCAL_MODE_OFF}) {
    set(mode);
    EXPECT_FALSE(rig.tick_until(RAVENCAL_STATE_ARMED, 500)) << mode;
    EXPECT_EQ(rig.output.state, RAVENCAL_STATE_FAULT);
  }
  rig.api().reset(rig.instance.get());
  rig.tick();
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_OFF);
}

TEST_F(Mode, AppliesTheShareToTheJointsOfTheMaskOnceThePedalIsUp) {
  EXPECT_EQ(rig.api().set_share(rig.instance.get(), 0.1F, 5), RAVENCAL_SUCCESS);
  set(RAVENCAL_MODE_ARM);
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  expect_share(0.1F, {true, false, true});
  rig.set_pedal(true);
  rig.api().set_share(rig.instance.get(), 1.0F, 7);
  for (int i = 0; i < 500; ++i) rig.tick();
  expect_share(0.1F, {true, false, true});
  rig.set_pedal(false);
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  expect_share(1.0F, {true, true, true});
}

TEST_F(Mode, RefusesModesAndSharesThatThereAreNot) {
  const ravencal_api& api = rig.api();
  for (const std::int32_t mode : {-1, 3, 100}) {
    EXPECT_EQ(api.set_mode(rig.instance.get(), mode), RAVENCAL_ERROR_ARGUMENT);
  }
  for (const float share : {-0.1F, 1.1F, std::numeric_limits<float>::quiet_NaN()}) {
    EXPECT_EQ(api.set_share(rig.instance.get(), share, 7), RAVENCAL_ERROR_ARGUMENT);
  }
  EXPECT_EQ(api.set_share(rig.instance.get(), 1.0F, 8), RAVENCAL_ERROR_ARGUMENT);
  EXPECT_EQ(api.set_mode(nullptr, RAVENCAL_MODE_ARM), RAVENCAL_ERROR_ARGUMENT);
  EXPECT_EQ(api.set_share(nullptr, 1.0F, 7), RAVENCAL_ERROR_ARGUMENT);
}

TEST(Cap, IsWhatTheTrainingOfTheWeightsSaw) {
  for (const float deviations : {0.0F, 4.0F}) {
    Rig rig([&](ravencal_config& config) { config.cap_deviations = deviations; });
    model::CalibrationModel model = make_model({plain("jpos.shoulder")}, {});
    model.layers[0].weights << 10.0F, 0.0F, 0.0F;
    model.layers[0].biases.setZero();
    rig.load(model);
    rig.enable();
    // Deviations of the error: 10 per half width of the range.
    const float middle = rig.state.arm[0].jpos_ji[0];
    rig.state.arm[0].jpos_ji[0] = middle + 0.5F * 0.39F;
    ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
    EXPECT_NEAR(rig.output.correction_ji[0], 0.02 + 3.9 * 0.004, 1e-6);
    rig.state.arm[0].jpos_ji[0] = middle + 0.5F * 0.41F;
    rig.tick();
    EXPECT_EQ(rig.output.doubts, deviations > 0.0F ? RAVENCAL_DOUBT_MAGNITUDE : 0U);
  }
}

TEST(HostOf31, ComesBackAfterAStopAndKnowsNoCapByTheWeights) {
  Rig rig;
  ravencal_config config{};
  config.struct_size = offsetof(ravencal_config, resume_after_stop);
  ASSERT_EQ(rig.api().default_config(&config), RAVENCAL_SUCCESS);
  EXPECT_EQ(config.cap_deviations, 0.0F) << "nothing is written beyond the host's struct";
  config.step_budget_ns = 0;
  auto instance = plugin_host::Instance::create(rig.library, config);
  ASSERT_TRUE(instance.ok()) << instance.error().message;
  model::CalibrationModel model = make_model({plain("jpos.shoulder")}, {});
  model.layers[0].weights << 10.0F, 0.0F, 0.0F;
  model.layers[0].biases.setZero();
  ASSERT_TRUE(instance.value().load(write_weights(model, "host_of_31")).ok());
  ravencal_state state = healthy_state();
  state.arm[0].jpos_ji[0] += 0.5F * 0.9F;
  ravencal_output output{};
  output.struct_size = offsetof(ravencal_output, would_be_ji);
  const auto run = [&](std::int32_t runlevel, int ticks) {
    state.runlevel = runlevel;
    for (int i = 0; i < ticks; ++i) {
      state.t_ns += config.tick_ns;
      rig.api().step(instance.value().get(), &state, &output);
      rig.api().observe_cycle_end(instance.value().get(), &state);
    }
  };
  rig.api().enable(instance.value().get(), 1);
  run(core::kPedalUp, 1000);
  EXPECT_EQ(output.state, RAVENCAL_STATE_ACTIVE);
  run(core::kEmergencyStop, 1000);
  EXPECT_EQ(output.state, RAVENCAL_STATE_ARMED);
  run(core::kPedalUp, 1000);
  EXPECT_EQ(output.state, RAVENCAL_STATE_ACTIVE);
  EXPECT_EQ(output.would_be_state, 0);
}

}  // namespace
}  // namespace ravencal::test
