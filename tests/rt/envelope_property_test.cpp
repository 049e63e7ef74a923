// SPDX-License-Identifier: Apache-2.0
//
// Whatever the robot, the weights and the host do: one tick changes the correction by at most the
// slew (or, in normal work, the maximum rate), the output is the input plus the correction, and the
// correction never exceeds its limit.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <thread>

#include "rt/rig.hpp"

namespace ravencal::test {
namespace {

constexpr double kTickS = 1e-3;

/// Follows the output from tick to tick.
class Witness {
 public:
  explicit Witness(const ravencal_config& config) : config_(config) {}

  void see(const ravencal_state& state, const ravencal_output& output) {
    for (int j = 0; j < RAVENCAL_JOINTS; ++j) {
      const double before = before_[j];
      const auto now = static_cast<double>(output.correction_ji[j]);
      RC_ASSERT(std::isfinite(now));
      const bool working = output.state == RAVENCAL_STATE_ACTIVE;
      const auto rate = static_cast<double>(working ? config_.max_correction_rate_ji_per_s[j]
                                                    : config_.slew_ji_per_s[j]);
      // Rounding: a few units in the last place of the correction.
      RC_ASSERT(std::abs(now - before) <= rate * kTickS * 1.0001 + 1e-8);
      RC_ASSERT(std::abs(now) <= static_cast<double>(config_.max_correction_ji[j]) * 1.0001);
      const float own = state.arm[0].jpos_ji[j];
      const float expected = output.correction_ji[j] == 0.0F ? own : own + output.correction_ji[j];
      RC_ASSERT(std::memcmp(&expected, &output.jpos_ji[j], sizeof expected) == 0 ||
                (std::isnan(expected) && std::isnan(output.jpos_ji[j])));
      before_[j] = now;
    }
    const bool resting =
        output.state == RAVENCAL_STATE_OFF || output.state == RAVENCAL_STATE_ARMED ||
        output.state == RAVENCAL_STATE_BYPASS || output.state == RAVENCAL_STATE_FAULT;
    for (const float correction : output.correction_ji) {
      RC_ASSERT(!resting || correction == 0.0F);
    }
  }

 private:
  ravencal_config config_;
  double before_[RAVENCAL_JOINTS] = {};
};

/// Any bit pattern, or a value near the trained range: both happen often.
float any_float(std::mt19937_64& random) {
  const auto bits = static_cast<std::uint32_t>(random());
  float value = 0.0F;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

void disturb(std::mt19937_64& random, ravencal_state& state) {
  const auto slot = random() % RAVENCAL_SLOTS;
  switch (random() % 12) {
    case 0:
      state.arm[0].jpos_ji[slot] = any_float(random);
      break;
    case 1:
      state.arm[0].mpos_rad[slot] = any_float(random);
      break;
    case 2:
      state.arm[0].tau_n_m[slot] = any_float(random);
      break;
    case 3:
      state.arm[0].enc_counts[slot] = static_cast<std::int32_t>(random());
      break;
    case 4:
      state.runlevel = static_cast<std::int32_t>(random() % 6) - 1;
      break;
    case 5:
      state.arm[0].joints_ready = static_cast<std::uint32_t>(random());
      break;
    case 6:
      state.t_ns = static_cast<std::int64_t>(random());
      break;
    case 7:
      state.t_ns -= 1'000'000;
      break;
    default:
      state.arm[0].jpos_ji[slot] +=
          0.01F * static_cast<float>(static_cast<int>(random() % 64) - 32);
      break;
  }
}

RC_GTEST_PROP(EnvelopeProperty, NeverStepsWhateverComesIn, ()) {
  const auto seed = *rc::gen::arbitrary<std::uint64_t>();
  std::mt19937_64 random(seed);
  Rig rig;
  model::CalibrationModel model = make_model(120, {64, 64}, seed);
  model.output.scale *= std::pow(10.0, static_cast<double>(random() % 4));  // up to far too large
  rig.load(model);
  rig.enable();
  Witness witness(rig.config);
  for (int i = 0; i < 3000; ++i) {
    if (random() % 50 == 0) disturb(random, rig.state);
    if (random() % 100 == 0) rig.state = healthy_state(rig.state.t_ns);
    if (random() % 500 == 0) rig.enable(random() % 3 != 0);
    if (random() % 700 == 0) rig.api().reset(rig.instance.get());
    const std::int32_t status = rig.tick();
    witness.see(rig.state, rig.output);
    RC_ASSERT(status >= RAVENCAL_OK && status <= RAVENCAL_FAULT);
    RC_ASSERT((status == RAVENCAL_FAULT) == (rig.output.state == RAVENCAL_STATE_FAULT));
  }
}

RC_GTEST_PROP(EnvelopeProperty, NeverStepsWhenWeightsAreSwappedAtAnyTime, ()) {
  std::mt19937_64 random(*rc::gen::arbitrary<std::uint64_t>());
  Rig rig;
  rig.enable();
  Witness witness(rig.config);
  for (int swap = 0; swap < 10; ++swap) {
    model::CalibrationModel model = make_model(30, {}, random());
    model.output.mean = Eigen::Vector3d::Random() * 0.1;  // each asks for something else
    model.output.mean[2] *= 0.1;
    rig.load(model);
    for (auto ticks = random() % 1500; ticks > 0; --ticks) {
      rig.tick();
      witness.see(rig.state, rig.output);
    }
  }
}

TEST(Swap, ManyLoadsUnderARunningLoopMakeNoStepAndLoseNoModel) {
  Rig rig;
  std::vector<std::filesystem::path> files;
  for (std::uint64_t i = 0; i < 4; ++i) {
    model::CalibrationModel model = make_model(30, {128, 64, 32}, i);
    model.output.mean *= i % 2 == 0 ? 1.0 : -1.0;
    files.push_back(write_weights(model, "swap" + std::to_string(i)));
  }
  ASSERT_TRUE(rig.instance.load(files[0]).ok());
  rig.enable();
  constexpr int kLoads = 2000;
  std::atomic<bool> loading{true};
  std::thread loader([&] {
    for (int i = 0; i < kLoads; ++i) {
      EXPECT_TRUE(rig.instance.load(files[static_cast<std::size_t>(i) % files.size()]).ok());
    }
    loading = false;
  });
  Witness witness(rig.config);
  while (loading) {
    rig.tick();
    witness.see(rig.state, rig.output);
  }
  loader.join();
  rig.tick();
  const ravencal_counters counters = rig.instance.counters();
  EXPECT_GT(counters.swaps, 10U);
  EXPECT_LE(counters.swaps, kLoads + 1U);
  EXPECT_TRUE(rig.tick_until(RAVENCAL_STATE_ACTIVE));
}

}  // namespace
}  // namespace ravencal::test
