// SPDX-License-Identifier: Apache-2.0
//
// The page of what the plugin did or would have done: every figure from ticks whose answer is
// known, and every finding found.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "core/run_level.hpp"
#include "shadow/operation.hpp"

namespace ravencal::shadow {
namespace {

/// As monitor/tick_recording.cpp has it.
record::Recording ticks(Eigen::Index rows) {
  record::Recording recording;
  recording.source = "R.db";
  recording.meta["profile"] = "telemetry";
  recording.meta["tick_ns"] = "1000000";
  for (const char* joint : {"shoulder", "elbow", "insertion"}) {
    for (const char* kind : {"jpos.", "would_be.", "offset."}) {
      recording.channels.push_back(
          {std::string(kind) + joint, "rad", record::Role::kFeature, joint});
    }
  }
  for (const char* name : {"runlevel", "state", "would_be_state", "doubts", "step", "tick"}) {
    recording.channels.push_back({name, "1", record::Role::kFeature, ""});
  }
  recording.samples.setZero(rows, static_cast<Eigen::Index>(recording.channels.size()));
  for (Eigen::Index row = 0; row < rows; ++row) {
    recording.t_ns.push_back(row * 1'000'000);
  }
  return recording;
}

void set(record::Recording& recording, const std::string& channel, Eigen::Index from,
         Eigen::Index count, double value) {
  recording.samples.col(recording.column(channel).value()).segment(from, count).setConstant(value);
}

/// A second in shadow: ARMED, then 0.8 s ACTIVE, of which 0.5 s in one press.
record::Recording one_second() {
  record::Recording recording = ticks(1000);
  set(recording, "runlevel", 0, 1000, core::kPedalUp);
  set(recording, "runlevel", 400, 500, core::kPedalDown);
  set(recording, "state", 0, 1000, RAVENCAL_STATE_SHADOW);
  set(recording, "would_be_state", 0, 200, RAVENCAL_STATE_ARMED);
  set(recording, "would_be_state", 200, 800, RAVENCAL_STATE_ACTIVE);
  set(recording, "would_be.elbow", 200, 800, -0.12);
  set(recording, "would_be.elbow", 600, 400, -0.121);
  set(recording, "offset.elbow", 500, 100, 0.02);
  set(recording, "jpos.elbow", 0, 1000, 1.5);
  set(recording, "jpos.elbow", 700, 1, 1.7);
  set(recording, "doubts", 0, 200, RAVENCAL_DOUBT_WARMING_UP);
  set(recording, "step", 0, 1000, 5e-6);
  set(recording, "step", 30, 1, 70e-6);
  for (Eigen::Index row = 0; row < 1000; ++row) set(recording, "tick", row, 1, row + 5.0);
  return recording;
}

TEST(ShadowOperation, CountsWhatWouldHaveBeen) {
  const auto result = operation_in(one_second());
  ASSERT_TRUE(result.ok()) << result.error().message;
  const Operation& operation = result.value();
  EXPECT_EQ(operation.ticks, 1000U);
  EXPECT_EQ(operation.lost_ticks, 0U);
  EXPECT_NEAR(operation.tick_s, 1e-3, 1e-12);
  EXPECT_EQ(operation.shadow_ticks, 1000U);
  EXPECT_EQ(operation.pedal_down_ticks, 500U);
  EXPECT_EQ(operation.corrected_ticks, 500U);
  EXPECT_EQ(operation.presses, 1U);
  EXPECT_EQ(operation.ticks_in_state[RAVENCAL_STATE_ARMED], 200U);
  EXPECT_EQ(operation.ticks_in_state[RAVENCAL_STATE_ACTIVE], 800U);
  EXPECT_EQ(operation.ticks_in_doubt[6], 200U);
  EXPECT_NEAR(operation.longest_step_s, 70e-6, 1e-12);
  const JointOperation& elbow = operation.joints[1];
  EXPECT_NEAR(elbow.largest_ji, 0.121, 1e-12);
  EXPECT_EQ(elbow.press_change_ji, 0.0);
  EXPECT_NEAR(elbow.follow_change_ji, 0.001, 1e-12);
  EXPECT_NEAR(elbow.offset_ji, 0.02, 1e-12);
  EXPECT_EQ(elbow.lowest_ji, 1.5);
  EXPECT_EQ(elbow.highest_ji, 1.7);
  EXPECT_TRUE(findings(operation).empty());
  const std::string text = operation_text(operation);
  for (const char* part :
       {"100.0 % of them in shadow", "would be corrected 100.0 %", "that it would be in", "active",
        "80.00 %", "warming_up", "6.933", "85.9 to 97.4 deg", "longest step 70.0 us"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  }
  const auto json = nlohmann::json::parse(operation_json(operation));
  EXPECT_EQ(json["corrected_ticks"], 500);
  EXPECT_EQ(json["states"]["active"], 800);
  EXPECT_EQ(json["joints"][1]["unit"], "rad");
}

TEST(ShadowOperation, FindsWhatSpeaksAgainstArming) {
  struct Case {
    const char* says;
    std::function<void(record::Recording&)> make;
  };
  for (const Case& one :
       {Case{"FAULT", [](auto& r) { set(r, "would_be_state", 900, 5, RAVENCAL_STATE_FAULT); }},
        Case{"FAULT", [](auto& r) { set(r, "doubts", 900, 5, RAVENCAL_DOUBT_NETWORK); }},
        Case{"less of the correction",
             [](auto& r) { set(r, "doubts", 401, 5, RAVENCAL_DOUBT_PRESS); }},
        Case{"changed the correction of the elbow by 1.1459 deg",
             [](auto& r) { set(r, "would_be.elbow", 400, 600, -0.14); }},
        Case{"2 steps took longer than half a cycle, the longest 600 us",
             [](auto& r) { set(r, "step", 300, 2, 600e-6); }}}) {
    record::Recording recording = one_second();
    one.make(recording);
    const auto operation = operation_in(recording);
    ASSERT_TRUE(operation.ok());
    const auto found = findings(operation.value());
    ASSERT_EQ(found.size(), 1U) << one.says;
    EXPECT_NE(found[0].find(one.says), std::string::npos) << found[0];
    EXPECT_NE(operation_text(operation.value()).find("finding: "), std::string::npos);
  }
}

TEST(ShadowOperation, CountsLostTicksAndTakesNoChangeAcrossThem) {
  record::Recording recording = one_second();
  for (Eigen::Index row = 400; row < 1000; ++row) set(recording, "tick", row, 1, row + 105.0);
  set(recording, "would_be.elbow", 400, 600, -0.2);
  const auto operation = operation_in(recording);
  ASSERT_TRUE(operation.ok());
  EXPECT_EQ(operation.value().lost_ticks, 100U);
  EXPECT_EQ(operation.value().joints[1].press_change_ji, 0.0);
}

TEST(ShadowOperation, TakesALostOrWildValueForNone) {
  record::Recording recording = one_second();
  set(recording, "doubts", 10, 1, std::nan(""));
  set(recording, "doubts", 11, 1, -1e300);
  set(recording, "would_be_state", 12, 1, 1e300);
  set(recording, "would_be.elbow", 13, 1, std::numeric_limits<double>::infinity());
  const auto operation = operation_in(recording);
  ASSERT_TRUE(operation.ok());
  EXPECT_EQ(operation.value().ticks_in_doubt[6], 198U);
  EXPECT_NEAR(operation.value().joints[1].largest_ji, 0.121, 1e-12);
}

TEST(ShadowOperation, SaysWhichChannelIsMissing) {
  record::Recording recording = one_second();
  recording.channels[4].name = "other";
  const auto operation = operation_in(recording);
  ASSERT_FALSE(operation.ok());
  EXPECT_NE(operation.error().message.find("R.db: has no channel 'would_be.elbow'"),
            std::string::npos)
      << operation.error().message;
  EXPECT_FALSE(operation_in(ticks(0)).ok());
  record::Recording no_tick = one_second();
  no_tick.meta["tick_ns"] = "none";
  ASSERT_FALSE(operation_in(no_tick).ok());
  EXPECT_NE(operation_in(no_tick).error().message.find("meta 'tick_ns'"), std::string::npos);
  EXPECT_TRUE(is_of_monitor(recording));
  recording.meta["profile"] = "raven2";
  EXPECT_FALSE(is_of_monitor(recording));
}

}  // namespace
}  // namespace ravencal::shadow
