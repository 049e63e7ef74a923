// SPDX-License-Identifier: Apache-2.0
//
// A step uses no heap, in any state and on any input; and the alarm that says so rings.
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <memory>
#include <string>

#include "rt/alarm.hpp"
#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

TEST(HeapAlarm, RingsForThisProgramAndForALoadedLibrary) {
  arm_heap_alarm();
  std::unique_ptr<std::string> text(new std::string(1000, 'x'));
  text.reset();
  EXPECT_GE(disarm_heap_alarm(), 4U);
  // fmt is a shared object of its own here: its allocations must be seen as the plugin's would be.
  arm_heap_alarm();
  void* const library = ::dlopen("libsqlite3.so.0", RTLD_NOW | RTLD_LOCAL);
  const std::uint64_t loading = disarm_heap_alarm();
  ASSERT_NE(library, nullptr) << ::dlerror();
  EXPECT_GT(loading, 0U);
  using Mprintf = char* (*)(const char*, ...);
  const auto print = reinterpret_cast<Mprintf>(::dlsym(library, "sqlite3_mprintf"));
  ASSERT_NE(print, nullptr);
  arm_heap_alarm();
  char* const made = print("%d", 7);
  EXPECT_GE(disarm_heap_alarm(), 1U);
  EXPECT_STREQ(made, "7");
}

class Step : public ::testing::TestWithParam<model::packed::Precision> {};

INSTANTIATE_TEST_SUITE_P(EveryPrecision, Step,
                         ::testing::Values(model::packed::Precision::kFloat32,
                                           model::packed::Precision::kBfloat16,
                                           model::packed::Precision::kInt8));

TEST_P(Step, UsesNoHeapInAMillionCyclesOfEveryKind) {
  Rig rig;
  std::vector<model::FeatureSpec> features;
  for (const char* joint : {"shoulder", "elbow", "insertion"}) {
    for (const char* field : {"jpos.", "mpos.", "mvel.", "tau.", "dac."}) {
      features.push_back(plain(std::string(field) + joint));
    }
    features.push_back(lagged(std::string("jpos.") + joint, 5));
    features.push_back(with_play(std::string("jpos.") + joint, 0.01F));
  }
  rig.load(make_model(features, {128, 64, 32}), GetParam());
  rig.enable();
  ASSERT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
  float uncorrected[RAVENCAL_JOINTS];
  arm_heap_alarm();
  for (int i = 0; i < 1'000'000; ++i) {
    // A new kind of trouble every 997 ticks, for 13 ticks.
    const bool trouble = i % 997 < 13;
    switch (trouble ? i / 997 % 6 : 6) {
      case 0:
        rig.state.arm[0].jpos_ji[0] = std::numeric_limits<float>::quiet_NaN();
        break;
      case 1:
        rig.state.runlevel = 0;
        break;
      case 2:
        rig.state.t_ns += 50'000'000;
        break;
      case 3:
        rig.state.arm[0].mpos_rad[1] = 1e30F;
        break;
      case 4:
        rig.enable(false);
        break;
      case 5:
        rig.api().reset(rig.instance.get());
        break;
      default:
        rig.state = healthy_state(rig.state.t_ns);
        rig.enable();
    }
    rig.tick();
    rig.api().uncorrect_desired(rig.instance.get(), rig.output.jpos_ji, uncorrected);
  }
  const std::uint64_t heap_calls = disarm_heap_alarm();
  // healthy_state() and Rig are this test's own and use the stack only.
  EXPECT_EQ(heap_calls, 0U);
  const ravencal_counters counters = rig.instance.counters();
  EXPECT_GT(counters.ticks_in_state[RAVENCAL_STATE_ACTIVE], 10'000U);
  EXPECT_GT(counters.ticks_in_state[RAVENCAL_STATE_FADING_OUT], 1'000U);
}

}  // namespace
}  // namespace ravencal::test
