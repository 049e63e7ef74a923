// SPDX-License-Identifier: Apache-2.0
#include "report/reduce.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ravencal::report {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::vector<double> times(std::size_t samples, double period_s = 0.01) {
  std::vector<double> t_s;
  for (std::size_t i = 0; i < samples; ++i) t_s.push_back(period_s * static_cast<double>(i));
  return t_s;
}

TEST(Timeline, LaysRecordingsEndToEnd) {
  const Timeline timeline = timeline_of(std::vector<double>{0.0, 0.1, 0.2, 0.0, 0.1});
  ASSERT_EQ(timeline.t_s.size(), 5U);
  EXPECT_NEAR(timeline.t_s[3], 0.3, 1e-12);
  EXPECT_NEAR(timeline.t_s[4], 0.4, 1e-12);
  ASSERT_EQ(timeline.recording_starts.size(), 1U);
  EXPECT_NEAR(timeline.recording_starts[0], 0.3, 1e-12);
  ASSERT_EQ(timeline.stretches.size(), 2U);
  EXPECT_EQ(timeline.stretches[1].begin, 3U);
}

TEST(Timeline, BreaksAtATimeGapButNotAtJitter) {
  std::vector<double> t_s = times(100);
  for (std::size_t i = 50; i < 100; ++i) t_s[i] += 0.05;  // jitter: 6 periods
  EXPECT_EQ(timeline_of(t_s).stretches.size(), 1U);
  for (std::size_t i = 50; i < 100; ++i) t_s[i] += 1.0;
  EXPECT_EQ(timeline_of(t_s).stretches.size(), 2U);
}

TEST(Envelope, KeepsAOneSampleSpike) {
  const std::vector<double> t_s = times(30000);
  std::vector<double> values(t_s.size(), 0.0);
  values[12345] = 7.0;
  const auto line = envelope(timeline_of(t_s), values, {0, values.size()}, 500);
  EXPECT_LE(line.size(), 1000U);
  EXPECT_TRUE(
      std::any_of(line.begin(), line.end(), [](const Point& point) { return point.value == 7.0; }));
}

TEST(Envelope, InterruptsTheLineWhereSamplesAreMissing) {
  const std::vector<double> t_s = times(1000);
  std::vector<double> values(t_s.size(), 1.0);
  for (std::size_t i = 400; i < 600; ++i) values[i] = kNan;
  const auto line = envelope(timeline_of(t_s), values, {0, values.size()}, 100);
  const auto gaps = std::count_if(line.begin(), line.end(),
                                  [](const Point& point) { return std::isnan(point.value); });
  EXPECT_EQ(gaps, 1);
}

TEST(Envelope, InterruptsTheLineAtATimeGapAndBetweenRecordings) {
  std::vector<double> t_s = times(300);
  for (std::size_t i = 100; i < 200; ++i) t_s[i] += 5.0;
  for (std::size_t i = 200; i < 300; ++i) t_s[i] -= 2.0;
  const std::vector<double> values(t_s.size(), 1.0);
  const auto line = envelope(timeline_of(t_s), values, {0, values.size()}, 50);
  const auto gaps = std::count_if(line.begin(), line.end(),
                                  [](const Point& point) { return std::isnan(point.value); });
  EXPECT_EQ(gaps, 2);
}

TEST(Envelope, DrawsNothingWhenEverySampleIsMissing) {
  const std::vector<double> values(100, kNan);
  EXPECT_TRUE(envelope(timeline_of(times(100)), values, {0, 100}, 10).empty());
}

TEST(Histogram, PutsBoundariesAndOutliersIntoTheOutermostBins) {
  const Histogram bins = histogram(std::vector<double>{-1.0, 1.0, -50.0, 50.0, 0.0, kNan}, 1.0, 5);
  EXPECT_EQ(bins.counts, (std::vector<std::uint64_t>{2, 0, 1, 0, 2}));
  EXPECT_DOUBLE_EQ(bins.from, -1.0);
  EXPECT_DOUBLE_EQ(bins.width, 0.4);
}

TEST(Quantiles, EndAtThePeak) {
  const auto quantiles = magnitude_quantiles(std::vector<double>{-4.0, 1.0, 2.0, -3.0, kNan}, 4);
  ASSERT_EQ(quantiles.size(), 4U);
  EXPECT_DOUBLE_EQ(quantiles[0].magnitude, 1.0);
  EXPECT_DOUBLE_EQ(quantiles[0].share, 0.25);
  EXPECT_DOUBLE_EQ(quantiles[3].magnitude, 4.0);
  EXPECT_DOUBLE_EQ(quantiles[3].share, 1.0);
}

TEST(Quantiles, AreEmptyWithoutASample) {
  EXPECT_TRUE(magnitude_quantiles(std::vector<double>{kNan}, 10).empty());
}

TEST(Summary, IsTheRmsAndPeakOfWhatIsThere) {
  const Summary summary = summary_of(std::vector<double>{3.0, -4.0, kNan});
  EXPECT_EQ(summary.samples, 2U);
  EXPECT_DOUBLE_EQ(summary.rmse, std::sqrt(12.5));
  EXPECT_DOUBLE_EQ(summary.peak, 4.0);
  EXPECT_TRUE(std::isnan(summary_of(std::vector<double>{kNan}).rmse));
}

TEST(ErrorMap, KeepsDirectionsApartAndLeavesUnvisitedCellsEmpty) {
  const std::vector<double> x = {0.0, 0.0, 1.0, 1.0};
  const std::vector<double> y = {0.0, 0.0, 1.0, 1.0};
  const std::vector<double> error = {3.0, -1.0, 2.0, kNan};
  const std::vector<std::int8_t> direction = {1, -1, 1, 1};
  const auto grid = grid_over(x, y, 2);
  ASSERT_TRUE(grid.has_value());
  const auto rising = error_map(*grid, x, y, error, direction, 1);
  ASSERT_EQ(rising.size(), 4U);
  EXPECT_EQ(rising[0].samples, 1U);
  EXPECT_DOUBLE_EQ(rising[0].rmse, 3.0);
  EXPECT_EQ(rising[1].samples, 0U);
  EXPECT_EQ(rising[2].samples, 0U);
  EXPECT_EQ(rising[3].samples, 1U);
  const auto falling = error_map(*grid, x, y, error, direction, -1);
  EXPECT_DOUBLE_EQ(falling[0].mean, -1.0);
  EXPECT_EQ(falling[3].samples, 0U);
}

TEST(ErrorMap, NeedsAnExtentInBothDirections) {
  EXPECT_FALSE(
      grid_over(std::vector<double>{1.0, 1.0}, std::vector<double>{0.0, 2.0}, 4).has_value());
  EXPECT_FALSE(grid_over(std::vector<double>{kNan}, std::vector<double>{kNan}, 4).has_value());
}

TEST(Direction, FollowsTheTruthAndRestsBetween) {
  const std::vector<double> t_s = times(900);
  std::vector<double> truth;
  for (std::size_t i = 0; i < 900; ++i) {
    truth.push_back(i < 300   ? 0.1 * static_cast<double>(i)
                    : i < 600 ? 30.0
                              : 90.0 - 0.1 * static_cast<double>(i));
  }
  const auto direction = direction_of_motion(timeline_of(t_s), truth);
  EXPECT_EQ(direction[150], 1);
  EXPECT_EQ(direction[450], 0);
  EXPECT_EQ(direction[750], -1);
}

TEST(Direction, IsNotInventedWhereTheTruthIsMissing) {
  std::vector<double> truth(100, kNan);
  for (const std::int8_t sign : direction_of_motion(timeline_of(times(100)), truth))
    EXPECT_EQ(sign, 0);
}

TEST(DetailWindows, ShowTheLargestErrorAndATypicalOne) {
  const std::vector<double> t_s = times(10000);
  std::vector<double> error(t_s.size(), 0.1);
  error[7777] = -3.0;
  const auto windows = detail_windows(timeline_of(t_s), error, 10.0);
  ASSERT_TRUE(windows.has_value());
  EXPECT_LE(windows->worst.begin, 7777U);
  EXPECT_GT(windows->worst.end, 7777U);
  EXPECT_NEAR(static_cast<double>(windows->worst.end - windows->worst.begin), 1000, 2);
  const std::span<const double> all(error);
  const IndexRange typical = windows->typical;
  EXPECT_NEAR(summary_of(all.subspan(typical.begin, typical.end - typical.begin)).rmse, 0.1, 1e-9);
}

TEST(DetailWindows, AreNotTakenFromAShortRecording) {
  EXPECT_FALSE(
      detail_windows(timeline_of(times(1500)), std::vector<double>(1500, 1.0), 10.0).has_value());
}

}  // namespace
}  // namespace ravencal::report
