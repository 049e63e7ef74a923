// SPDX-License-Identifier: Apache-2.0
//
// Blocks of errors, their correlation and intervals.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/random.hpp"
#include "study/bootstrap.hpp"
#include "study/error_blocks.hpp"

namespace ravencal::study {
namespace {

std::vector<double> times(std::size_t count, double rate_hz = 100.0) {
  std::vector<double> t_s;
  for (std::size_t i = 0; i < count; ++i) t_s.push_back(static_cast<double>(i) / rate_hz);
  return t_s;
}

/// Autoregressive noise x' = a x + e: integrated autocorrelation time (1 + a) / (1 - a).
std::vector<double> correlated(std::size_t count, double a, std::uint64_t seed) {
  core::Random random(seed);
  std::vector<double> values;
  double x = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    x = a * x + random.uniform() + random.uniform() + random.uniform() - 1.5;
    values.push_back(x);
  }
  return values;
}

TEST(StudyErrors, BlocksGiveBackRmseAndPeak) {
  const std::vector<double> errors = correlated(3050, 0.5, 1);
  const ErrorBlocks blocks = blocks_of(times(errors.size()), errors);
  double squares = 0.0;
  double peak = 0.0;
  for (const double error : errors) {
    squares += error * error;
    peak = std::max(peak, std::abs(error));
  }
  EXPECT_EQ(blocks.squares.size(), 7U);  // six of 5 s and half a second
  EXPECT_NEAR(blocks.rmse(), std::sqrt(squares / 3050.0), 1e-12);
  EXPECT_EQ(blocks.peak, peak);
}

TEST(StudyErrors, LostSamplesAreNotCountedAndMoveNoBlock) {
  std::vector<double> errors(1500, 2.0);
  for (std::size_t i = 500; i < 1000; ++i) errors[i] = std::nan("");
  const ErrorBlocks blocks = blocks_of(times(errors.size()), errors);
  EXPECT_EQ(blocks.counts, (std::vector<std::uint32_t>{500, 0, 500}));
  EXPECT_DOUBLE_EQ(blocks.rmse(), 2.0);
}

TEST(StudyErrors, AClockThatJumpsYearsTakesNoMemory) {
  std::vector<double> t_s = times(1500);
  for (std::size_t i = 1000; i < 1500; ++i) t_s[i] += 9e9;
  const std::vector<double> errors(1500, 0.5);
  const ErrorBlocks blocks = blocks_of(t_s, errors);
  EXPECT_EQ(blocks.counts, (std::vector<std::uint32_t>{500, 500, 500}));
  EXPECT_DOUBLE_EQ(blocks.rmse(), 0.5);
}

TEST(StudyErrors, IndependentSamplesAreWorthThemselvesAndCorrelatedOnesLess) {
  const std::vector<double> white = correlated(40000, 0.0, 2);
  EXPECT_NEAR(autocorrelation_time(white), 1.0, 0.1);
  const std::vector<double> slow = correlated(40000, 0.9, 3);
  EXPECT_NEAR(autocorrelation_time(slow), 19.0, 3.0);
  const ErrorBlocks blocks = blocks_of(times(slow.size()), slow);
  // The square of a Gaussian with correlation a^k has correlation a^2k: (1 + 0.81) / (1 - 0.81).
  EXPECT_NEAR(blocks.effective_samples, 40000.0 / 9.5, 1000.0);
}

TEST(StudyErrors, AConstantErrorHasNoCorrelationToMeasure) {
  const std::vector<double> errors(1000, 0.3);
  EXPECT_EQ(blocks_of(times(1000), errors).effective_samples, 1000.0);
  EXPECT_EQ(autocorrelation_time(errors), 1.0);
}

SeedErrors seeds_of(std::size_t seeds, std::uint64_t first, double scale = 1.0) {
  SeedErrors errors;
  for (std::size_t s = 0; s < seeds; ++s) {
    std::vector<double> values = correlated(30000, 0.98, first + s);
    for (double& value : values) value *= scale;
    errors.push_back({blocks_of(times(values.size()), values)});
  }
  return errors;
}

TEST(StudyErrors, TheIntervalHoldsTheTruthAboutAsOftenAsItSays) {
  // RMSE of the process: variance of the noise (3/12) over 1 - a^2.
  const double truth = std::sqrt(0.25 / (1.0 - 0.98 * 0.98));
  int held = 0;
  constexpr int kTrials = 100;
  for (int trial = 0; trial < kTrials; ++trial) {
    const SeedErrors errors = seeds_of(1, 100 + static_cast<std::uint64_t>(trial));
    const Resamples resamples = resamples_for(std::span(&errors, 1), 1);
    const Interval interval = central_interval(resamples.rmse(errors));
    if (interval.low <= truth && truth <= interval.high) ++held;
  }
  // 95 of 100 wanted; blocks of a five-minute recording fall a little short. Fixed seeds.
  EXPECT_GE(held, 85);
}

TEST(StudyErrors, RowsAreDrawnTogetherSoThatTheirRatioIsExact) {
  const SeedErrors one = seeds_of(3, 7);
  const SeedErrors twice = seeds_of(3, 7, 2.0);
  const Resamples resamples = resamples_for(std::span(&one, 1), 5);
  const std::vector<double> a = resamples.rmse(one);
  const std::vector<double> b = resamples.rmse(twice);
  ASSERT_EQ(a.size(), kResamples);
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(b[i] / a[i], 2.0, 1e-12);
  EXPECT_NE(a[0], a[1]);
}

TEST(StudyErrors, TooFewFiniteValuesHaveNoInterval) {
  const Interval interval = central_interval(std::vector<double>(39, 1.0));
  EXPECT_TRUE(std::isnan(interval.low) && std::isnan(interval.high));
}

}  // namespace
}  // namespace ravencal::study
