// SPDX-License-Identifier: Apache-2.0
//
// Whatever the robot, the weights and the host do: one tick changes the correction by at most the
// slew (or, in normal work, the maximum rate), the output is the input plus the correction, and the
// correction never exceeds its limit.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "rt/rig.hpp"
#include "rt/witness.hpp"

namespace ravencal::test {
namespace {

/// Any bit pattern, or a value near the trained range: both happen often.
float any_float(std::mt19937_64& random) {
  const auto bits = static_cast<std::uint32_t>(random());
  float value = 0.0F;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

void disturb(std::mt19937_64& random, ravencal_state& state) {
  const auto slot = random() % RAVENCAL_SLOTS;
  switch (random() % 15) {
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
    case 8:
      state.arm[0].jpos_ji[slot] =
          std::numeric_limits<float>::denorm_min() * static_cast<float>(1 + random() % 1000);
      break;
    case 9:
      state.arm[0].jpos_d_ji[slot] = any_float(random);
      break;
    case 10:
      state.arm[0].jpos_d_ji[slot] += 0.001F * static_cast<float>(random() % 64);
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
  Witness witness(rig.config, Witness::Desired::kPublished);
  for (int i = 0; i < 3000; ++i) {
    if (random() % 50 == 0) disturb(random, rig.state);
    if (random() % 100 == 0) rig.state = healthy_state(rig.state.t_ns);
    if (random() % 500 == 0) rig.enable(random() % 3 != 0);
    if (random() % 700 == 0) rig.api().reset(rig.instance.get());
    const std::int32_t status = rig.tick();
    RC_ASSERT(witness.see(rig.state, rig.output) == "");
    RC_ASSERT(status >= RAVENCAL_OK && status <= RAVENCAL_FAULT);
    RC_ASSERT((status == RAVENCAL_FAULT) == (rig.output.state == RAVENCAL_STATE_FAULT));
  }
  RC_ASSERT(witness.check(rig.instance.counters()) == "");
}

RC_GTEST_PROP(EnvelopeProperty, NeverStepsWhenWeightsAreSwappedAtAnyTime, ()) {
  std::mt19937_64 random(*rc::gen::arbitrary<std::uint64_t>());
  Rig rig;
  rig.enable();
  Witness witness(rig.config, Witness::Desired::kPublished);
  for (int swap = 0; swap < 5; ++swap) {
    model::CalibrationModel model = make_model(30, {}, random());
    model.output.mean = Eigen::Vector3d::Random() * 0.1;  // each asks for something else
    model.output.mean[2] *= 0.1;
    rig.load(model);
    for (auto ticks = random() % 1500; ticks > 0; --ticks) {
      rig.tick();
      RC_ASSERT(witness.see(rig.state, rig.output) == "");
    }
  }
}

}  // namespace
}  // namespace ravencal::test
