// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/suggest.hpp"

#include <gtest/gtest.h>

namespace {

using namespace ravencal;

constexpr std::string_view kTied = R"({"schema":1,"effects":[{"id":"gain_error","joint":"elbow",
 "separate_by":"","ambiguous_with":["compliance"]}],
 "unexplained":[{"joint":"wrist","stage":"drive","share_of_excess":0.4,"depends_on":["speed"]}],
 "not_found":[{"id":"creep","joint":"elbow","not_testable_because":"too short","by_recording":true},
 {"id":"slip","joint":"elbow","detection_limit":0.1,"unit":"rad"}]})";

TEST(Suggest, PartsATieFirstThenTheUnexplainedThenTheUntested) {
  const auto list = diagnose::suggest(kTied, "test");
  ASSERT_TRUE(list.ok()) << list.error().message;
  ASSERT_EQ(list->suggestions.size(), 3U);
  EXPECT_NE(list->suggestions.at(0).experiment.find("500 g"), std::string::npos)
      << list->suggestions.at(0).experiment;
  EXPECT_NE(list->suggestions.at(1).experiment.find("speed"), std::string::npos)
      << list->suggestions.at(1).experiment;
  EXPECT_NE(list->suggestions.at(2).experiment.find("hold"), std::string::npos)
      << list->suggestions.at(2).experiment;
  EXPECT_LT(list->suggestions.at(0).urgency, list->suggestions.at(2).urgency);
}

TEST(Suggest, SaysOnceWhatOneReasonKeptFromBeingTested) {
  const auto list = diagnose::suggest(
      R"({"schema":1,"effects":[],"unexplained":[],"not_found":[
 {"id":"slip","joint":"elbow","not_testable_because":"no truth","by_recording":true},
 {"id":"lost_counts","joint":"elbow","not_testable_because":"no truth","by_recording":true},
 {"id":"slip","joint":"wrist","not_testable_because":"no truth","by_recording":true}]})",
      "test");
  ASSERT_TRUE(list.ok());
  ASSERT_EQ(list->suggestions.size(), 1U);
  EXPECT_EQ(list->suggestions.front().why,
            "joint elbow, wrist: tests slip, lost counts, not testable so far: no truth");
}

TEST(Suggest, AsksForNoRecordingOfWhatNoneWouldTest) {
  const auto list = diagnose::suggest(
      R"({"schema":1,"effects":[],"unexplained":[],"not_found":[
 {"id":"homing_offset","joint":"elbow","not_testable_because":"drawn","by_recording":false},
 {"id":"creep","joint":"elbow","not_testable_because":"too short","by_recording":true}]})",
      "test");
  ASSERT_TRUE(list.ok());
  ASSERT_EQ(list->suggestions.size(), 1U);
  EXPECT_NE(list->suggestions.front().why.find("creep"), std::string::npos)
      << list->suggestions.front().why;
}

TEST(Suggest, KnowsTheCheapestExperimentOfAPairAndOfNoOther) {
  const diagnose::Experiment* parted = diagnose::cheapest_parting("backlash", "creep");
  ASSERT_NE(parted, nullptr);
  EXPECT_EQ(parted->minutes, 3.0);
  EXPECT_EQ(diagnose::cheapest_parting("slip", "lost_counts"), nullptr);
}

TEST(Suggest, HasNothingToSayWhereAllIsKnown) {
  const auto list =
      diagnose::suggest(R"({"schema":1,"effects":[],"unexplained":[],"not_found":[]})", "test");
  ASSERT_TRUE(list.ok());
  EXPECT_TRUE(list->suggestions.empty());
}

TEST(Suggest, NamesTheFileThatIsNoReport) {
  const auto list = diagnose::suggest("{\"schema\":1}", "other.json");
  ASSERT_FALSE(list.ok());
  EXPECT_NE(list.error().message.find("other.json"), std::string::npos);
}

TEST(Suggest, SaysWhereToConfirmThatNothingWasFound) {
  const auto list = diagnose::suggest(
      R"({"schema":1,"effects":[],"unexplained":[],"not_found":[],
 "recordings":[{"name":"a.db","held_out":false,"duration_s":120}],
 "channels":[{"joint":"elbow","stage":"drive","where":{"cells":60,"cells_visited":41}}]})",
      "test");
  ASSERT_TRUE(list.ok()) << list.error().message;
  ASSERT_EQ(list->suggestions.size(), 3U);
  for (const auto& s : list->suggestions) EXPECT_EQ(s.urgency, 3);
  EXPECT_NE(list->suggestions.front().why.find("41 of 60"), std::string::npos)
      << list->suggestions.front().why;
  EXPECT_DOUBLE_EQ(list->suggestions.front().minutes, 2.0);
}

}  // namespace
