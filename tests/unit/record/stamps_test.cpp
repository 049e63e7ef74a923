// SPDX-License-Identifier: Apache-2.0
//
// What the fields of a row say of its time.
#include "record/stamps.hpp"

#include <gtest/gtest.h>

#include <random>

namespace ravencal::record {
namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;

TEST(Stamps, ReadsDatesAndClocks) {
  struct Text {
    const char* unit;
    const char* text;
    std::optional<std::int64_t> ns;
  };
  const Text cases[] = {
      {"date", "1970-01-01 00:00:00", 0},
      {"date", "1970-01-02T00:00:01.25Z", 86401 * kSecondNs + 250'000'000},
      {"date", "2024-02-29 12:00", 1709208000 * kSecondNs},
      {"date", "2024/02/29 14:00:00,5+02:00", 1709208000 * kSecondNs + 500'000'000},
      {"date", "2024-02-29T10:30:00-0130", 1709208000 * kSecondNs},
      {"date", "2023-02-29 12:00:00", {}},
      {"date", "2024-02-29", {}},
      {"date", "2024-02-29 12:00:00 pm", {}},
      {"date", "", {}},
      {"clock", "01:02:03.004005", 3723 * kSecondNs + 4'005'000},
      {"clock", "1:02", 3720 * kSecondNs},
      {"clock", "01:62:03", {}},
      {"clock", "3.5", {}},
  };
  for (const Text& c : cases) EXPECT_EQ(ns_of_text(c.unit, c.text), c.ns) << c.text;
}

TEST(Stamps, AddsAFractionToSecondsWithoutRounding) {
  const std::vector<double> seconds = {1732900000.0, 1732900001.0};
  const std::vector<double> fractions = {999'999'999.0, 1.0};
  const Stamps stamps = stamps_of({}, {seconds, fractions, {}});
  EXPECT_EQ(stamps[0], 1732900000 * kSecondNs + 999'999'999);
  EXPECT_EQ(stamps[1], 1732900001 * kSecondNs + 1);
}

TEST(Stamps, CountsTheTurnsOfACounterWhateverOneBadStampSays) {
  Clock clock;
  clock.unit = "us";
  clock.wraps_at = 65536.0;
  std::vector<double> counts;
  for (int row = 0; row < 100; ++row) counts.push_back((60000 + 4000 * row) % 65536);
  counts[50] = 3.0;
  const Stamps stamps = stamps_of(clock, {counts, {}, {}});
  for (int row = 0; row < 100; ++row) {
    if (row == 50) continue;
    EXPECT_EQ(stamps[static_cast<std::size_t>(row)], (60000 + 4000 * row) * 1000);
  }
}

TEST(Stamps, AClockGoesOnAfterMidnight) {
  const std::vector<std::string> words = {"23:59:59.5", "00:00:00.0", "00:00:00.5"};
  Clock clock;
  clock.unit = "clock";
  const Stamps stamps = stamps_of(clock, {{}, {}, words});
  EXPECT_EQ(*stamps[1] - *stamps[0], kSecondNs / 2);
  EXPECT_EQ(*stamps[2] - *stamps[1], kSecondNs / 2);
}

TEST(Stamps, KeepsTheLargestRisingPart) {
  EXPECT_EQ(longest_rising({1, 2, 900, 3, 3, {}, 4, 0, 5}),
            (std::vector<bool>{true, true, false, true, true, false, true, false, true}));
  EXPECT_EQ(longest_rising({}), std::vector<bool>());
  EXPECT_EQ(longest_rising({{}, {}}), (std::vector<bool>{false, false}));
}

TEST(Stamps, SpreadsRoundedStampsByTheirRateFromGapToGap) {
  constexpr std::int64_t kStepNs = 10'000'000;
  std::vector<std::int64_t> truth_ns, t_ns;
  for (int row = 0; row < 2000; ++row) {
    truth_ns.push_back(5'000'000LL * row + (row < 700 ? 0 : 3 * kSecondNs));
    t_ns.push_back(truth_ns.back() / kStepNs * kStepNs);
  }
  spread_rounded(t_ns, kStepNs);
  for (std::size_t row = 1; row < t_ns.size(); ++row) {
    EXPECT_LE(std::abs(t_ns[row] - truth_ns[row]), kStepNs);
    if (row == 700) continue;
    EXPECT_NEAR(static_cast<double>(t_ns[row] - t_ns[row - 1]), 5e6, 1e5);
  }
}

TEST(Stamps, SpreadsEqualStampsWhereTheRateIsNotEven) {
  std::vector<std::int64_t> t_ns = {0, 0, 10, 10, 10, 10, 20, 30, 30, 40, 60, 60, 60, 60, 80};
  spread_rounded(t_ns, 10);
  for (std::size_t row = 1; row < t_ns.size(); ++row) EXPECT_GT(t_ns[row], t_ns[row - 1]);
}

}  // namespace
}  // namespace ravencal::record
