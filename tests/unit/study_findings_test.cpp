// SPDX-License-Identifier: Apache-2.0
//
// Each finding is a check that can fail: results made so that it holds, and so that it does not.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "core/random.hpp"
#include "study/ablation_tables.hpp"
#include "study/findings.hpp"
#include "study/paper_figures.hpp"

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
  blocks.peak = 3.0 * rmse;
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
  return {{std::string(kOperatingStatus), 1.0},
          {std::string(kJointPoses), 1.1},
          {std::string(kEndEffector), 1.03},
          {std::string(kAllPoses), 3.0},
          {std::string(kTorques), 1.6},
          {"velocity", 1.1},
          {"jacobian", 1.02},
          {"joint_1", 1.1},
          {"joint_2", 2.0},
          {"joint_3", 1.2},
          {"joint_4", 1.0}};
}

/// The tests of the network with all features, beside the removals.
struct Spoilt {
  double flip = 2.0;
  double triple = 1.3;
  double poses = 1.2;      ///< noise on the joint poses, inputs alone
  double released = 25.0;  ///< and in the believed angles
  double torques = 1.1;    ///< noise on the torques
};

/// `joints_without` overrides the three joints' RMSE without a set.
Verdict verdict_of(const std::map<std::string, double>& removal, const Spoilt& spoilt,
                   const std::string& finding,
                   const std::map<std::string, std::array<double, 3>>& joints_without = {}) {
  const Condition condition = condition_of(false);
  Results results;
  results.conditions.emplace_back(condition, joints());
  ConditionResults& own = results.conditions.front();
  add_row(own, RowId{}, 1.0);
  for (const auto& [row, rmse] : removal) {
    if (!joints_without.contains(row)) add_row(own, network(row), rmse);
  }
  for (const auto& [row, rmse] : joints_without)
    add_row(own, network(row), {{rmse[0]}, {rmse[1]}, {rmse[2]}});
  const auto add_test = [&](const std::string& id, double rmse) {
    add_row(own, {std::string(kNoAblation), id}, rmse);
  };
  add_test(variant_id(Noise::kFlip, kTorques), spoilt.flip);
  add_test(variant_id(Noise::kTriple, kTorques), spoilt.triple);
  add_test(variant_id(Noise::kDeviation, kTorques), spoilt.torques);
  add_test(variant_id(Noise::kDeviation, kJointPoses), spoilt.poses);
  add_test(released_id(kJointPoses), spoilt.released);
  for (const Finding& found : findings_of(results)) {
    if (found.id == finding) return found.verdict;
  }
  return Verdict::kNotTested;
}

TEST(StudyFindings, AllPosesMatterMostUnlessAnotherGroupMattersMore) {
  auto removal = as_the_paper_found();
  EXPECT_EQ(verdict_of(removal, {}, "all_poses"), Verdict::kHolds);
  removal[std::string(kTorques)] = 4.0;
  EXPECT_EQ(verdict_of(removal, {}, "all_poses"), Verdict::kDoesNotHold);
  removal[std::string(kTorques)] = 3.0;
  EXPECT_EQ(verdict_of(removal, {}, "all_poses"), Verdict::kUndecided);
}

TEST(StudyFindings, TheEndEffectorStandsInUnlessErrorsRiseWithoutMotorSidePoses) {
  auto removal = as_the_paper_found();
  EXPECT_EQ(verdict_of(removal, {}, "end_effector_stands_in"), Verdict::kHolds);
  removal[std::string(kJointPoses)] = 1.5;
  EXPECT_EQ(verdict_of(removal, {}, "end_effector_stands_in"), Verdict::kDoesNotHold);
  removal[std::string(kJointPoses)] = 1.1;
  removal[std::string(kAllPoses)] = 1.2;  // then there is nothing to stand in for
  EXPECT_EQ(verdict_of(removal, {}, "end_effector_stands_in"), Verdict::kDoesNotHold);
}

TEST(StudyFindings, DirectionMattersMoreUnlessAmplitudeDoes) {
  const auto removal = as_the_paper_found();
  EXPECT_EQ(verdict_of(removal, {}, "torque_direction"), Verdict::kHolds);
  EXPECT_EQ(verdict_of(removal, {.flip = 1.3, .triple = 2.0}, "torque_direction"),
            Verdict::kDoesNotHold);
}

TEST(StudyFindings, JointTwoCarriesUnlessAnotherJointDoes) {
  auto removal = as_the_paper_found();
  EXPECT_EQ(verdict_of(removal, {}, "joint_2"), Verdict::kHolds);
  removal["joint_3"] = 2.5;
  EXPECT_EQ(verdict_of(removal, {}, "joint_2"), Verdict::kDoesNotHold);
}

TEST(StudyFindings, InaccuratePosesAreWorseThanMissingOnesUnlessMissingOnesAre) {
  auto removal = as_the_paper_found();
  for (const char* finding : {"inaccurate_poses", "inaccurate_poses_released"}) {
    EXPECT_EQ(verdict_of(removal, {}, finding), Verdict::kHolds) << finding;
    EXPECT_EQ(verdict_of(removal, {.poses = 1.1, .released = 1.1}, finding), Verdict::kUndecided);
    EXPECT_EQ(verdict_of(removal, {.poses = 1.0, .released = 1.0}, finding), Verdict::kDoesNotHold);
  }
  // The paper's figures hold as released and say nothing of the inputs.
  EXPECT_EQ(verdict_of(removal, {.poses = 1.0}, "inaccurate_poses_released"), Verdict::kHolds);
  EXPECT_EQ(verdict_of(removal, {.poses = 1.0}, "inaccurate_poses"), Verdict::kDoesNotHold);
}

TEST(StudyFindings, MissingTorquesAreWorseThanInaccurateOnesUnlessInaccurateOnesAre) {
  const auto removal = as_the_paper_found();
  EXPECT_EQ(verdict_of(removal, {}, "missing_torque"), Verdict::kHolds);
  EXPECT_EQ(verdict_of(removal, {.torques = 1.9}, "missing_torque"), Verdict::kDoesNotHold);
}

TEST(StudyFindings, JointThreeNeedsTheTorquesMostUnlessItNeedsAnotherGroupMore) {
  const auto removal = as_the_paper_found();
  const std::string torques(kTorques), poses(kAllPoses);
  EXPECT_EQ(verdict_of(removal, {}, "torque_joint_3",
                       {{torques, {1.0, 1.7, 2.2}}, {poses, {3.0, 4.0, 1.6}}}),
            Verdict::kHolds);
  EXPECT_EQ(verdict_of(removal, {}, "torque_joint_3",
                       {{torques, {3.0, 3.0, 1.6}}, {poses, {1.0, 1.0, 2.2}}}),
            Verdict::kDoesNotHold);
}

TEST(StudyFindings, JointTwoSpoilsTwoAndThreeAloneUnlessItSpoilsOneOrSparesThree) {
  const auto removal = as_the_paper_found();
  const auto verdict = [&](const std::array<double, 3>& without) {
    return verdict_of(removal, {}, "joint_2_spoils", {{"joint_2", without}});
  };
  EXPECT_EQ(verdict({1.2, 4.5, 1.8}), Verdict::kHolds);
  EXPECT_EQ(verdict({1.5, 4.5, 1.8}), Verdict::kDoesNotHold);
  EXPECT_EQ(verdict({1.2, 4.5, 1.1}), Verdict::kDoesNotHold);
}

TEST(StudyFindings, JointsOneAndThreeCanBeLeftOutUnlessAJointRisesBeyondTheMark) {
  const auto removal = as_the_paper_found();
  EXPECT_EQ(verdict_of(removal, {}, "joints_1_and_3"), Verdict::kHolds);
  EXPECT_EQ(verdict_of(removal, {}, "joints_1_and_3", {{"joint_3", {1.0, 1.5, 1.0}}}),
            Verdict::kDoesNotHold);
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
  add_row(own, network(std::string(kJointPoses)), 0.0128);
  add_row(own, network(std::string(kTorques)), 0.0132);
  const std::vector<Table> tables = ablation_tables(plan, results);
  const Table& removal = tables.front();
  ASSERT_EQ(removal.rows.size(), 3U);
  EXPECT_EQ(removal.rows[1].cells[0].mark, Mark::kNone);
  EXPECT_EQ(removal.rows[2].cells[0].mark, Mark::kWorse);
  EXPECT_DOUBLE_EQ(removal.rows[0].cells[0].theirs, 0.3003);
  EXPECT_DOUBLE_EQ(removal.rows[2].cells[5].theirs,
                   1.2021);  // the insertion's peak without torques
  EXPECT_EQ(removal.columns[0].unit, "deg");
  // Radians became degrees: 0.01 rad is 0.573 deg.
  EXPECT_NEAR(removal.rows[0].cells[0].mean, 0.573, 0.01);
  EXPECT_LT(removal.rows[0].cells[0].low, removal.rows[0].cells[0].mean);
  // A peak is marked as an RMSE is, and has a deviation but no interval.
  EXPECT_EQ(removal.columns[1].title, "shoulder peak");
  EXPECT_NEAR(removal.rows[0].cells[1].mean, 3.0 * removal.rows[0].cells[0].mean, 0.02);
  EXPECT_EQ(removal.rows[2].cells[1].mark, Mark::kWorse);
  EXPECT_GT(removal.rows[0].cells[1].deviation, 0.0);
  EXPECT_TRUE(std::isnan(removal.rows[0].cells[1].low));
  const std::string text = to_text(removal);
  EXPECT_NE(text.find("(0.300)"), std::string::npos) << text;
  EXPECT_NE(text.find("torque (torque, current)"), std::string::npos) << text;
  EXPECT_NE(text.find("*"), std::string::npos) << text;
}

TEST(StudyTables, EveryFigureOfThePaperHasARow) {
  for (const FeatureSet& set : paper_sets()) {
    for (const std::string_view condition : {kUnloaded, kLoaded}) {
      for (const PaperTable table : {PaperTable::kRemoval, PaperTable::kInaccurate}) {
        EXPECT_GT(paper_figure(table, condition, set.id, "insertion", true), 0.5) << set.id;
      }
    }
  }
  for (const Noise noise : kTorqueNoises)
    EXPECT_GT(paper_figure(PaperTable::kTorque, kLoaded, name_of(noise), "elbow", false), 0.3);
  for (const std::string_view row :
       {kAllFeatures, kInaccurateEncoder, kOnlyEncoder, kOnlyInaccurateEncoder})
    EXPECT_GT(paper_figure(PaperTable::kHoming, kRehomed, row, "shoulder", false), 0.1) << row;
  EXPECT_DOUBLE_EQ(paper_figure(PaperTable::kHoming, kHomedOnce, kNoEncoder, "elbow", true),
                   1.7209);
  EXPECT_TRUE(std::isnan(paper_figure(PaperTable::kHoming, kHomedOnce, kNoEncoder, "wrist", true)));
  EXPECT_TRUE(std::isnan(paper_figure(PaperTable::kRemoval, kUnloaded, "joint_4", "elbow", true)));
}

}  // namespace
}  // namespace ravencal::study
