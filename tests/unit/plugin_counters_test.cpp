// SPDX-License-Identifier: Apache-2.0
//
// What the plugin says about itself: counters, transitions with their reasons, its own time.
#include <gtest/gtest.h>

#include <atomic>
#include <numeric>
#include <thread>

#include "core/run_level.hpp"
#include "rt/rig.hpp"
#include "rt_plugin/overruns.hpp"

namespace ravencal::test {
namespace {

std::uint64_t ticks_in_states(const ravencal_counters& counters) {
  return std::accumulate(std::begin(counters.ticks_in_state), std::end(counters.ticks_in_state),
                         std::uint64_t{0});
}

TEST(Counters, CountEveryTickOnceAndEveryTransitionWithItsReason) {
  Rig rig;
  rig.load(make_model(16, {}));
  rig.tick();
  rig.enable();
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  const ravencal_counters active = rig.instance.counters();
  rig.state.t_ns += 50'000'000;
  rig.tick();
  const std::int64_t jump_ns = rig.state.t_ns;
  rig.tick();
  rig.state.runlevel = core::kEmergencyStop;
  rig.tick();
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ARMED));

  const ravencal_counters counters = rig.instance.counters();
  EXPECT_EQ(ticks_in_states(counters), counters.ticks);
  EXPECT_EQ(counters.ticks_in_doubt[0], counters.ticks - active.ticks - 2);
  EXPECT_EQ(counters.ticks_in_doubt[2], 1U);
  EXPECT_EQ(counters.swaps, 1U);
  EXPECT_EQ(counters.rollbacks, 0U);
  struct Expected {
    std::int32_t from;
    std::int32_t to;
    std::uint32_t doubts;
    std::uint64_t tick;
  };
  const std::vector<Expected> expected = {
      {RAVENCAL_STATE_OFF, RAVENCAL_STATE_ARMED, 0, 2},
      {RAVENCAL_STATE_ARMED, RAVENCAL_STATE_FADING_IN, 0, 0},
      {RAVENCAL_STATE_FADING_IN, RAVENCAL_STATE_ACTIVE, 0, active.ticks},
      {RAVENCAL_STATE_ACTIVE, RAVENCAL_STATE_HOLD, RAVENCAL_DOUBT_TIME, active.ticks + 1},
      {RAVENCAL_STATE_HOLD, RAVENCAL_STATE_ACTIVE, 0, active.ticks + 2},
      {RAVENCAL_STATE_ACTIVE, RAVENCAL_STATE_FADING_OUT, RAVENCAL_DOUBT_ROBOT_STATE,
       active.ticks + 3},
      {RAVENCAL_STATE_FADING_OUT, RAVENCAL_STATE_ARMED, RAVENCAL_DOUBT_ROBOT_STATE,
       counters.ticks}};
  ASSERT_EQ(counters.transitions, expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const ravencal_transition& transition = counters.last_transitions[i];
    EXPECT_EQ(transition.from, expected[i].from) << i;
    EXPECT_EQ(transition.to, expected[i].to) << i;
    EXPECT_EQ(transition.doubts, expected[i].doubts) << i;
    if (expected[i].tick == 0) continue;  // not known beforehand
    EXPECT_EQ(transition.tick, expected[i].tick) << i;
  }
  EXPECT_EQ(counters.last_transitions[3].t_ns, jump_ns);
}

TEST(Counters, KeepTheNewestSixteenTransitions) {
  Rig rig;
  for (int i = 0; i < 20; ++i) {
    rig.enable(i % 2 == 0);
    rig.tick();
  }
  const ravencal_counters counters = rig.instance.counters();
  ASSERT_EQ(counters.transitions, 20U);
  for (std::uint64_t k = 4; k < 20; ++k) {
    const ravencal_transition& transition =
        counters.last_transitions[k % RAVENCAL_TRANSITIONS_KEPT];
    EXPECT_EQ(transition.tick, k + 1);
    EXPECT_EQ(transition.to, k % 2 == 0 ? RAVENCAL_STATE_ARMED : RAVENCAL_STATE_OFF);
  }
}

TEST(Counters, BelongTogetherWheneverAnotherThreadReadsThem) {
  Rig rig;
  rig.load(make_model(3, {}));
  std::atomic<bool> running{true};
  std::thread reader([&] {
    for (int i = 0; i < 20'000; ++i) {
      const ravencal_counters counters = rig.instance.counters();
      EXPECT_EQ(ticks_in_states(counters), counters.ticks);
    }
    running = false;
  });
  for (int i = 0; running; ++i) {
    rig.enable(i % 700 < 350);
    rig.tick();
  }
  reader.join();
}

class Overruns : public ::testing::Test {
 protected:
  /// No step can keep to a budget of 1 ns.
  Rig rig{[](ravencal_config& config) {
    config.step_budget_ns = 1;
    config.max_overruns = 50;
  }};
};

TEST_F(Overruns, EndTheCorrectionUntilReset) {
  rig.load(make_model(16, {}));
  rig.enable();
  for (int i = 0; i < 50; ++i) rig.tick();
  EXPECT_EQ(rig.output.doubts, 0U);
  EXPECT_GT(rig.output.step_ns, 0U);
  EXPECT_LT(rig.output.step_ns, 1'000'000'000U);
  rig.tick();
  EXPECT_EQ(rig.output.doubts, RAVENCAL_DOUBT_OVERRUN);
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_ARMED) << "none begins";
  const ravencal_counters counters = rig.instance.counters();
  EXPECT_EQ(counters.overruns, 51U);
  EXPECT_GE(counters.longest_step_ns, rig.output.step_ns);
  rig.api().reset(rig.instance.get());
  rig.tick();
  EXPECT_EQ(rig.output.state, RAVENCAL_STATE_OFF);
  EXPECT_EQ(rig.output.doubts, 0U);
}

TEST_F(Overruns, FadeOutACorrectionThatIsIn) {
  Rig slow([](ravencal_config& config) {
    config.step_budget_ns = 1;
    config.max_overruns = 64;
    for (float& slew : config.slew_ji_per_s) slew = 10.0F;
    config.tick_ns = 10'000'000;  // 10 ticks without a doubt, then one to fade in
  });
  slow.load(make_model(16, {}));
  slow.enable();
  ASSERT_TRUE(slow.tick_until(RAVENCAL_STATE_ACTIVE, 60));
  EXPECT_TRUE(slow.tick_until(RAVENCAL_STATE_CONSTANT, 60));
  const ravencal_counters counters = slow.instance.counters();
  const auto& last = counters.last_transitions[(counters.transitions - 1) % 16];
  EXPECT_EQ(last.doubts, RAVENCAL_DOUBT_OVERRUN);
  EXPECT_FALSE(slow.tick_until(RAVENCAL_STATE_FADING_IN, 100));
}

TEST_F(Overruns, CountWithinAThousandStepsOnly) {
  ravencal_config config{};
  config.step_budget_ns = 1000;
  config.max_overruns = 3;
  rt::OverrunWatch watch(config);
  EXPECT_FALSE(watch.count(10, 1000)) << "as long as the budget is not too long";
  for (const std::uint64_t tick : {11, 500, 1011, 1500, 2011}) {
    EXPECT_TRUE(watch.count(tick, 1001));
    EXPECT_FALSE(watch.exhausted()) << tick;
  }
  watch.count(2499, 1001);  // with 1500 and 2011
  EXPECT_TRUE(watch.exhausted());
  watch.count(9000, 1001);
  EXPECT_TRUE(watch.exhausted()) << "until reset";
  watch.reset();
  watch.count(9001, 1001);
  watch.count(9002, 1001);
  EXPECT_FALSE(watch.exhausted());
}

TEST_F(Overruns, AreNotLookedForWithoutABudget) {
  Rig patient([](ravencal_config& config) { config.step_budget_ns = 0; });
  for (int i = 0; i < 2000; ++i) patient.tick();
  EXPECT_EQ(patient.instance.counters().overruns, 0U);
  EXPECT_GT(patient.instance.counters().longest_step_ns, 0U);
}

}  // namespace
}  // namespace ravencal::test
