// SPDX-License-Identifier: Apache-2.0
//
// Each finding is a check that can fail: results made so that it holds, and so that it does not.
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "core/random.hpp"
#include "study/ablation_tables.hpp"
#include "study/findings.hpp"

namespace ravencal::study {
namespace {

constexpr std::size_t kSeeds = 5;

Condition condition_of(bool homing) {
  Condition condition;
  condition.title = homing ? "trained without re-homing" : "unloaded";
  condition.test =
      homing ? std::vector<std::string>{"h0", "h1", "h2"} : std::vector<std::string>{"t"};
  condition.homing = homing;
  return condition;
}

/// Blocks whose RMSE is `rmse`, give or take 2 % from block to block.
ErrorBlocks blocks_with(double rmse, std::uint64_t seed) {
  core::Random random(seed);
  ErrorBlocks blocks;
  for (int i = 0; i < 60; ++i) {
    blocks.counts.push_back(500);
    blocks.squares.push_back(500.0 * rmse * rmse * (0.96 + 0.08 * random.uniform()));
  }
  blocks.effective_samples = 3000.0;
  blocks.correlation_s = 1.0;
  return blocks;
}

/// Adds a row; `rmse`: [joint][recording].
void add_row(ConditionResults& results, const RowId& row,
             const std::vector<std::vector<double>>& rmse) {
  for (std::size_t seed = 0; seed < kSeeds; ++seed) {
    RowErrors errors{row.test, {}};
    for (const std::vector<double>& recordings : rmse) {
      errors.joints.emplace_back();
      for (const double one : recordings) {
        errors.joints.back().push_back(
            blocks_with(one * (1.0 + 0.002 * static_cast<double>(seed)), seed + 1));
      }
    }
    results.add(row, errors);
  }
}

void add_row(ConditionResults& results, const RowId& row, double rmse) {
  add_row(results, row, {{rmse}, {rmse}, {rmse}});
}

RowId network(const std::string& name) { return {name, std::string(kNoAblation)}; }

std::vector<JointName> joints() {
  return {{"shoulder", "rad"}, {"elbow", "rad"}, {"insertion", "m"}};
}

/// What the paper found, as figures; a test changes one of them.
std::map<std::string, double> as_the_paper_found() {
  return {{"time_and_state", 1.0},
          {"joint_pose", 1.05},
          {"motor_pose", 1.02},
          {"end_effector_pose", 1.03},
          {"velocity", 1.1},
          {"torque", 1.2},
          {"current", 1.01},
          {std::string(kAllPoses), 3.0},
          {std::string(kMotorSidePoses), 1.1},
          {"torque_and_current", 1.6},
          {"joint_1", 1.3},
          {"joint_2", 2.0},
          {"joint_3", 1.4},
          {"joint_4", 1.0}};
}

Verdict verdict_of(const std::map<std::string, double>& removal, double flip, double triple,
                   const std::string& finding) {
  const Condition condition = condition_of(false);
  Results results;
  results.conditions.emplace_back(condition, joints());
  ConditionResults& own = results.conditions.front();
  add_row(own, RowId{}, 1.0);
  for (const auto& [row, rmse] : removal) add_row(own, network(row), rmse);
  add_row(own, {std::string(kNoAblation), variant_id(Noise::kFlip, "tau_and_dac")}, flip);
  add_row(own, {std::string(kNoAblation), variant_id(Noise::kTriple, "tau_and_dac")}, triple);
  for (const Finding& found : findings_of(results)) {
    if (found.id == finding) return found.verdict;
  }
  return Verdict::kNotTested;
}

TEST(StudyFindings, AllPosesMatterMostUnlessAnotherGroupMattersMore) {
  auto removal = as_the_paper_found();
  EXPECT_EQ(verdict_of(removal, 2.0, 1.3, "all_poses"), Verdict::kHolds);
  removal["torque"] = 4.0;
  EXPECT_EQ(verdict_of(removal, 2.0, 1.3, "all_poses"), Verdict::kDoesNotHold);
  removal["torque"] = 3.0;
  EXPECT_EQ(verdict_of(removal, 2.0, 1.3, "all_poses"), Verdict::kUndecided);
}

TEST(StudyFindings, TheEndEffectorStandsInUnlessErrorsRiseWithoutMotorSidePoses) {
  auto removal = as_the_paper_found();
  EXPECT_EQ(verdict_of(removal, 2.0, 1.3, "end_effector_stands_in"), Verdict::kHolds);
  removal[std::string(kMotorSidePoses)] = 1.5;
  EXPECT_EQ(verdict_of(removal, 2.0, 1.3, "end_effector_stands_in"), Verdict::kDoesNotHold);
  removal[std::string(kMotorSidePoses)] = 1.1;
  removal[std::string(kAllPoses)] = 1.2;  // then there is nothing to stand in for
  EXPECT_EQ(verdict_of(removal, 2.0, 1.3, "end_effector_stands_in"), Verdict::kDoesNotHold);
}

TEST(StudyFindings, DirectionMattersMoreUnlessAmplitudeDoes) {
  const auto removal = as_the_paper_found();
  EXPECT_EQ(verdict_of(removal, 2.0, 1.3, "torque_direction"), Verdict::kHolds);
  EXPECT_EQ(verdict_of(removal, 1.3, 2.0, "torque_direction"), Verdict::kDoesNotHold);
}

TEST(StudyFindings, JointTwoCarriesUnlessAnotherJointDoes) {
  auto removal = as_the_paper_found();
  EXPECT_EQ(verdict_of(removal, 2.0, 1.3, "joint_2"), Verdict::kHolds);
  removal["joint_3"] = 2.5;
  EXPECT_EQ(verdict_of(removal, 2.0, 1.3, "joint_2"), Verdict::kDoesNotHold);
}

Finding homing_finding(double after, double cost, double dropped_after) {
  const Condition condition = condition_of(true);
  Results results;
  results.conditions.emplace_back(condition, joints());
  const std::vector<double> all = {1.0, after, after};
  const std::vector<double> none = {cost, dropped_after, dropped_after};
  add_row(results.conditions.front(), network("all"), {all, all, all});
  add_row(results.conditions.front(), network(std::string(kNoEncoder)), {none, none, none});
  return findings_of(results).front();
}

TEST(StudyFindings, EncoderValuesBreakAndAreNotMissedUnlessTheyDoNotOrAre) {
  EXPECT_EQ(homing_finding(5.0, 1.0, 1.0).verdict, Verdict::kHolds);
  EXPECT_EQ(homing_finding(1.0, 1.0, 1.0).verdict, Verdict::kDoesNotHold) << "nothing broke";
  EXPECT_EQ(homing_finding(5.0, 1.2, 1.2).verdict, Verdict::kDoesNotHold) << "they are missed";
  EXPECT_EQ(homing_finding(5.0, 1.0, 5.0).verdict, Verdict::kDoesNotHold) << "all breaks";
}

TEST(StudyFindings, WhatWasNotRunIsNotTestedAndFailsNoCheck) {
  const Condition condition = condition_of(false);
  Results results;
  results.conditions.emplace_back(condition, joints());
  add_row(results.conditions.front(), RowId{}, 1.0);
  const std::vector<Finding> findings = findings_of(results);
  for (const Finding& finding : findings) EXPECT_EQ(finding.verdict, Verdict::kNotTested);
  EXPECT_TRUE(all_hold(findings));
}

TEST(StudyFindings, OneThatDoesNotHoldFailsTheCheck) {
  std::vector<Finding> findings(2);
  findings[0].verdict = Verdict::kHolds;
  findings[1].verdict = Verdict::kHolds;
  EXPECT_TRUE(all_hold(findings));
  findings[1].verdict = Verdict::kUndecided;
  EXPECT_FALSE(all_hold(findings));
  findings[1].verdict = Verdict::kDoesNotHold;
  EXPECT_FALSE(all_hold(findings));
  EXPECT_NE(findings_json(findings).find("\"does not hold\""), std::string::npos);
}

TEST(StudyTables, TheMarkIsARiseOfMoreThanThirtyPercentAndTheirsStandBeside) {
  const Condition condition = condition_of(false);
  Plan plan;
  plan.study = "removal";
  plan.conditions = {condition};
  Results results;
  results.conditions.emplace_back(condition, joints());
  ConditionResults& own = results.conditions.front();
  add_row(own, RowId{}, 0.01);
  add_row(own, network("joint_pose"), 0.0128);
  add_row(own, network("torque"), 0.0132);
  const std::vector<Table> tables = ablation_tables(plan, results);
  const Table& removal = tables.front();
  ASSERT_EQ(removal.rows.size(), 3U);
  EXPECT_EQ(removal.rows[1].cells[0].mark, Mark::kNone);
  EXPECT_EQ(removal.rows[2].cells[0].mark, Mark::kWorse);
  EXPECT_DOUBLE_EQ(removal.rows[0].cells[0].theirs, 0.3003);
  EXPECT_EQ(removal.columns[0].unit, "deg");
  // Radians became degrees: 0.01 rad is 0.573 deg.
  EXPECT_NEAR(removal.rows[0].cells[0].mean, 0.573, 0.01);
  EXPECT_LT(removal.rows[0].cells[0].low, removal.rows[0].cells[0].mean);
}

}  // namespace
}  // namespace ravencal::study
