// SPDX-License-Identifier: Apache-2.0
//
// The floating-point mode of the plugin is its own: denormal numbers, which make float code tens of
// times slower, count as zero, nothing traps, and the caller's mode comes back. Seen in the
// results, not in the time, which a busy machine would decide.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstring>
#include <limits>
#include <vector>

#include "rt/rig.hpp"
#include "rt/system_call_alarm.hpp"

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace ravencal::test {
namespace {

constexpr float kDenormal = std::numeric_limits<float>::denorm_min() * 1024.0F;

TEST(Denormals, AreTakenAsZero) {
  // (x - mean) * inverse_scale with a scale so small that a denormal input would show.
  model::CalibrationModel model = make_model({plain("jpos.shoulder")}, {});
  model.input.mean[0] = 0.0;
  model.input.scale[0] = 1e-36;
  model.input_min[0] = -1e-30;
  model.input_max[0] = 1e-30;
  model.layers[0].weights.setOnes();
  model.layers[0].biases.setZero();
  model.output.mean.setZero();
  model.output.scale.setConstant(1e-4);
  Rig rig;
  rig.load(model);
  rig.state.arm[0].jpos_ji[0] = kDenormal;
  rig.tick();
  EXPECT_EQ(rig.output.predicted_ji[0], 0.0F);
  rig.state.arm[0].jpos_ji[0] = 1e-36F;  // a normal number does show
  rig.tick();
  EXPECT_NEAR(rig.output.predicted_ji[0], 1e-4, 1e-9);
}

TEST(Denormals, LeaveTheRobotsOwnValueAsItIs) {
  Rig rig;
  rig.state.arm[0].jpos_ji[0] = kDenormal;
  rig.tick();
  EXPECT_EQ(rig.output.jpos_ji[0], kDenormal);
}

#if defined(__x86_64__)
constexpr unsigned kPlain = 0x1F80U;
constexpr unsigned kTrapsAll = 0x0000U;
constexpr unsigned kFlags = 0x003FU;

/// Runs `work` in that mode; what the mode is after it.
template <typename Work>
unsigned mode_after(unsigned mode, const Work& work) {
  _mm_setcsr(mode);
  work();
  const unsigned after = _mm_getcsr();
  _mm_setcsr(kPlain);
  return after;
}

TEST(FloatMode, OfTheCallerComesBackAfterEveryStep) {
  Rig rig;
  rig.load(make_model(16, {}));
  const unsigned rounds_to_zero = kPlain | 0x6000U;
  for (const unsigned mode :
       {kPlain, kPlain | 0x8040U, rounds_to_zero, kPlain | kFlags, kTrapsAll}) {
    EXPECT_EQ(mode_after(mode, [&] { rig.tick(); }), mode);
  }
}

TEST(FloatMode, OfTheCallerChangesNoBitOfTheOutput) {
  Rig plain;
  Rig other;
  for (Rig* rig : {&plain, &other}) {
    rig->load(make_model(16, {8}));
    rig->enable();
  }
  for (int i = 0; i < 1500; ++i) {
    plain.tick();
    mode_after(kPlain | 0x4000U, [&] { other.tick(); });  // rounds up
    ASSERT_EQ(std::memcmp(&plain.output, &other.output, offsetof(ravencal_output, step_ns)), 0);
  }
  EXPECT_EQ(plain.output.state, RAVENCAL_STATE_ACTIVE);
}

/// What the robot's state may hold in its worst moments.
const std::vector<float> kBadValues = {std::numeric_limits<float>::quiet_NaN(),
                                       std::numeric_limits<float>::signaling_NaN(),
                                       std::numeric_limits<float>::infinity(),
                                       -std::numeric_limits<float>::infinity(),
                                       std::numeric_limits<float>::max(),
                                       kDenormal,
                                       0.0F};

TEST(FloatMode, OfAHostThatTrapsEveryExceptionDoesNotEndAnyCall) {
  const ChildEnd end = run_in_child([]() -> int {
    Rig rig([](ravencal_config& config) { config.arm = RAVENCAL_ARM_GOLD; });
    model::CalibrationModel model = make_model(16, {8});
    model.origin.arm = model::Arm::kGold;
    model.origin.coordinates = model::Coordinates::kMotor;
    const auto weights = write_weights(model, "trapping").string();
    bool sound = true;
    const auto call = [&](const auto& work) {
      sound = sound && (mode_after(kTrapsAll, work) == kTrapsAll);
    };
    ravencal_config bad = rig.config;
    bad.blend_share = std::numeric_limits<float>::signaling_NaN();
    bad.slew_ji_per_s[0] = std::numeric_limits<float>::quiet_NaN();
    alignas(64) static char storage[1U << 20U];
    ravencal_instance* instance = nullptr;
    call([&] { rig.api().create(&bad, storage, sizeof storage, &instance); });
    call([&] { rig.api().load(rig.instance.get(), weights.c_str()); });
    rig.enable();
    for (int i = 0; i < 3000; ++i) {
      rig.state = healthy_state(rig.state.t_ns);
      const float bad_value = kBadValues[static_cast<std::size_t>(i) % kBadValues.size()];
      const auto slot = static_cast<std::size_t>(i) / kBadValues.size() % RAVENCAL_SLOTS;
      if (i % 500 > 300) {
        rig.state.arm[0].jpos_ji[slot] = bad_value;
        rig.state.arm[0].jpos_d_ji[slot] = bad_value;
        rig.state.arm[0].tau_n_m[slot] = bad_value;
      }
      rig.state.runlevel = i % 1000 < 500 ? 2 : 3;
      call([&] { rig.tick(); });
      float uncorrected_ji[RAVENCAL_JOINTS] = {};
      float rotation[9] = {bad_value, 0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F};
      std::int32_t position_um[3] = {};
      call([&] {
        rig.api().uncorrect_desired(rig.instance.get(), rig.state.arm[0].jpos_ji, uncorrected_ji);
        rig.api().uncorrect_pose(rig.instance.get(), rig.state.arm[0].jpos_ji, uncorrected_ji,
                                 position_um, rotation);
      });
    }
    const bool corrected = rig.instance.counters().ticks_in_state[RAVENCAL_STATE_FADING_IN] > 0;
    return sound && corrected ? 0 : 1;
  });
  EXPECT_EQ(end.exit_code, 0) << "-1: ended by a signal";
}
#endif

}  // namespace
}  // namespace ravencal::test
