// SPDX-License-Identifier: Apache-2.0
//
// Denormal numbers make float code tens of times slower; the step flushes them and gives the
// caller's mode back. Seen in the results, not in the time, which a busy machine would decide.
#include <gtest/gtest.h>

#include <limits>

#include "rt/rig.hpp"

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
TEST(Denormals, FlushingEndsWithTheStep) {
  Rig rig;
  rig.load(make_model(16, {}));
  for (const unsigned mode : {0x1F80U, 0x9FC0U, 0x1F80U | 0x6000U}) {  // plain, FTZ|DAZ, round to 0
    _mm_setcsr(mode);
    rig.tick();
    const unsigned after = _mm_getcsr();
    _mm_setcsr(0x1F80U);
    EXPECT_EQ(after, mode);
  }
}
#endif

}  // namespace
}  // namespace ravencal::test
