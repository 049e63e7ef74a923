// SPDX-License-Identifier: Apache-2.0
//
// That bench_step's checks ring: what it times is what was asked for.
#include <gtest/gtest.h>

#include <limits>
#include <numeric>

#include "bench/step_maximum.hpp"
#include "bench/step_peers.hpp"
#include "ravencal/plugin.h"

namespace ravencal::bench {
namespace {

using kernels::Precision;

Deviation deviation_of(const Peer& peer, const Reference& reference) {
  std::array<float, 16> outputs{};
  if (peer.prepare) peer.prepare();
  peer.step(outputs.data());
  return deviation(reference, outputs);
}

class BenchStep : public ::testing::TestWithParam<Precision> {
 protected:
  Task task = make_task({112, 128, 64, 32, 3});
};

TEST_P(BenchStep, PluginAndKernelStayWithinTheBoundOfTheStoredWeights) {
  for (const Peer& peer :
       {plugin_peer(task, GetParam(), RAVENCAL_ISA_BEST),
        plugin_peer(task, GetParam(), RAVENCAL_ISA_BASELINE), kernel_peer(task, GetParam())}) {
    ASSERT_TRUE(peer.skipped.empty()) << peer.skipped;
    const Deviation off = deviation_of(peer, *peer.reference);
    EXPECT_FALSE(off.is_beyond_bound()) << peer.name << ": " << off.error;
    EXPECT_LT(*off.bound, 1e-3) << peer.name;
  }
}

TEST_P(BenchStep, AWrongWeightIsBeyondTheBound) {
  const Peer right = plugin_peer(task, GetParam(), RAVENCAL_ISA_BEST);
  for (auto& layer : task.network) {
    float& weight = layer.weights.front();
    const float kept = weight;
    weight += 0.5F;
    const Peer wrong = plugin_peer(task, GetParam(), RAVENCAL_ISA_BEST);
    const Deviation off = deviation_of(wrong, *right.reference);
    EXPECT_TRUE(off.is_beyond_bound()) << off.error << " of " << *off.bound;
    weight = kept;
  }
}

INSTANTIATE_TEST_SUITE_P(EveryPrecision, BenchStep,
                         ::testing::Values(Precision::kFloat32, Precision::kBfloat16,
                                           Precision::kInt8));

TEST(BenchStepDeviation, IsThatOfTheOutputWorstInProportionToItsBound) {
  const Reference reference{{1.0, 2.0}, {0.1, 0.5}};
  const float outputs[] = {1.2F, 2.3F};
  EXPECT_DOUBLE_EQ(*deviation(reference, outputs).bound, 0.1);
  EXPECT_TRUE(deviation(reference, outputs).is_beyond_bound());
  const float near[] = {1.0F, 2.3F};
  EXPECT_DOUBLE_EQ(*deviation(reference, near).bound, 0.5);
  EXPECT_FALSE(deviation(reference, near).is_beyond_bound());
  const float no_number[] = {std::numeric_limits<float>::quiet_NaN(), 2.0F};
  EXPECT_TRUE(deviation(reference, no_number).is_beyond_bound());
  const Reference unbounded{{1.0, 2.0}, {}};
  EXPECT_NEAR(deviation(unbounded, near).error, 0.3, 1e-6);
  EXPECT_FALSE(deviation(unbounded, near).is_beyond_bound());
}

TEST(BenchStepMaximum, CountsEveryStep) {
  Peer peer = empty_peer();
  const Histogram histogram = time_back_to_back(peer, 1000);
  EXPECT_EQ(std::accumulate(histogram.steps.begin(), histogram.steps.end(), std::uint64_t{0}),
            1000U);
}

TEST(BenchStepMaximum, PutsATimeIntoTheBinThatBeginsBelowIt) {
  Histogram histogram;
  for (const std::int64_t ns : {0, 1, 1023, 1024, 1025}) histogram.add(ns);
  histogram.add(std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(histogram.steps[0], 2U);
  EXPECT_EQ(histogram.steps[9], 1U);
  EXPECT_EQ(histogram.steps[10], 2U);
  EXPECT_EQ(histogram.steps.back(), 1U);
  EXPECT_EQ(histogram.longest_ns, std::numeric_limits<std::int64_t>::max());
}

TEST(BenchStepMaximum, ClaimsNoBoundOnACoreThatIsNotIsolated) {
  EXPECT_TRUE(is_listed("2-3,6", 3));
  EXPECT_TRUE(is_listed("2-3,6", 6));
  EXPECT_FALSE(is_listed("2-3,6", 4));
  EXPECT_FALSE(is_listed("", 0));
  EXPECT_NE(isolation_note("", 1).find("no bound is claimed"), std::string::npos);
  EXPECT_NE(isolation_note("2-3", 1).find("no bound is claimed"), std::string::npos);
  EXPECT_EQ(isolation_note("1-3", 1).find("no bound is claimed"), std::string::npos);
}

TEST(BenchStepTorch, FindsTheBlasInTheConfiguration) {
  EXPECT_EQ(blas_of("PyTorch built with:\n  - Build settings: BLAS_INFO=atlas, BUILD_TYPE=None,"),
            "atlas");
  EXPECT_EQ(blas_of("  - Build settings: BUILD_TYPE=None, BLAS_INFO=open"), "open");
  EXPECT_EQ(blas_of("PyTorch built with:\n  - GCC 12.2\n"), "unknown");
}

}  // namespace
}  // namespace ravencal::bench
