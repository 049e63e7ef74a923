// SPDX-License-Identifier: Apache-2.0
#include "record/summary.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace ravencal::record {
namespace {

Recording sample_recording() {
  Recording recording;
  recording.source = "r.db";
  recording.channels = {{"est", "m", Role::kJointEstimate, "x"},
                        {"tru", "m", Role::kJointTruth, "x"}};
  recording.samples.resize(4, 2);
  recording.samples << 1.0, 1.3, 2.0, 2.1, 3.0, std::numeric_limits<double>::quiet_NaN(), 4.0, 4.2;
  recording.t_ns = {0, 10'000'000, 20'000'000, 520'000'000};
  recording.events = {{5, "homing", "done"}};
  return recording;
}

TEST(Summary, FindsRateGapsRangesAndRawError) {
  const Summary summary = summarise(sample_recording());
  EXPECT_EQ(summary.rows, 4U);
  EXPECT_DOUBLE_EQ(summary.rate_hz, 100.0);
  EXPECT_EQ(summary.gaps, 1U);
  EXPECT_DOUBLE_EQ(summary.longest_gap_s, 0.5);
  EXPECT_EQ(summary.channels[1].lost, 1U);
  EXPECT_EQ(summary.channels[1].max, 4.2);
  ASSERT_EQ(summary.joints.size(), 1U);
  EXPECT_EQ(summary.joints[0].samples, 3U);
  EXPECT_NEAR(summary.joints[0].bias, 0.2, 1e-12);
  EXPECT_NEAR(summary.joints[0].rmse, std::sqrt((0.09 + 0.01 + 0.04) / 3), 1e-12);
  EXPECT_NEAR(summary.joints[0].peak, 0.3, 1e-12);
}

TEST(Summary, SpeaksInMillimetresAndNamesEvents) {
  const Recording recording = sample_recording();
  const std::string words = describe_in_words(recording, summarise(recording));
  EXPECT_NE(words.find("bias +200.0000, peak 300.0000 mm over 3 samples"), std::string::npos)
      << words;
  EXPECT_NE(words.find("events of kind homing: 1"), std::string::npos) << words;
  const std::string json = describe_in_json(recording, summarise(recording));
  EXPECT_NE(json.find("\"rate_hz\": 100.0"), std::string::npos) << json;
}

TEST(Summary, SaysWhatWasAssumed) {
  Recording recording = sample_recording();
  EXPECT_EQ(describe_in_words(recording, summarise(recording)).find("assum"), std::string::npos);
  recording.meta = {{"assumed_row_period_s", "0.004"},
                    {"assumed_time_unit", "ms"},
                    {"assumed_channels", "est, tru"}};
  const std::string words = describe_in_words(recording, summarise(recording));
  for (const char* part :
       {"the sample time was assumed: 4 ms", "the unit of the time of r.db was assumed: ms",
        "the unit, the joint or the sign of these channels of r.db is an assumption of its profile",
        ": est, tru\n"})
    EXPECT_NE(words.find(part), std::string::npos) << part << "\n" << words;
}

TEST(Summary, OfAnEmptyRecordingIsEmpty) {
  Recording recording;
  recording.channels = {{"a", "1", Role::kFeature, ""}};
  recording.samples.resize(0, 1);
  const Summary summary = summarise(recording);
  EXPECT_EQ(summary.rate_hz, 0.0);
  EXPECT_TRUE(std::isnan(summary.channels[0].min));
  EXPECT_FALSE(describe_in_json(recording, summary).empty());
}

}  // namespace
}  // namespace ravencal::record
