// SPDX-License-Identifier: Apache-2.0
//
// What the channels of one joint say about each other.
#include <gtest/gtest.h>

#include <algorithm>

#include "diagnose/channel/across_channels.hpp"
#include "diagnose/diagnose.hpp"
#include "diagnose/free_run/judge.hpp"

namespace {

using namespace ravencal::diagnose;

/// Friction behind the cable that the drive doubled, in a plant whose cable says that much of it.
NamedEffect doubled_behind_cable(const Interval& cable_n_m, bool loop) {
  ravencal::physics::Plant plant;
  plant.joints.resize(1);
  plant.joints[0].name = "one";
  plant.joints[0].effects = {{"compliance", {}, {{"stiffness", 300.0}}},
                             {"joint_friction", {}, {{"level", 0.4}}}};
  NamedEffect e;
  e.id = "joint_friction";
  e.joint = "one";
  e.stage = "drive";
  e.out_of_tolerance = true;
  e.parameters = {{"level", 0.8, "N_m", {0.77, 0.83}}};
  Report report;
  report.effects = {e};
  std::vector<ChannelFindings> findings(1);
  findings.front().joint = "one";
  findings.front().friction_behind = cable_n_m;
  if (loop) {
    e.id = "hysteresis";
    e.stage = "transmission";
    report.effects.push_back(e);
  }
  move_friction_to_motor(plant, findings, report);
  return report.effects.front();
}

TEST(AcrossJoints, FrictionThatTheCableDoesNotShowIsTheMotors) {
  const NamedEffect moved = doubled_behind_cable({0.3, 0.6}, false);
  EXPECT_EQ(moved.id, "coulomb_friction");
  EXPECT_FALSE(moved.out_of_tolerance) << "the plant has none: it is missing physics";
  const NamedParameter& level = moved.parameters.front();
  EXPECT_NEAR(level.value, 0.4, 1e-9);
  EXPECT_LT(level.ci95.first, 0.4 - 1.96 * 0.04) << "what is behind the cable may be off";
  EXPECT_EQ(doubled_behind_cable({0.2, 1.2}, false).id, "joint_friction")
      << "the cable cannot show it";
  EXPECT_EQ(doubled_behind_cable({0.3, 0.6}, true).id, "joint_friction") << "the cable has a loop";
}

/// Names of the drive beside a loop of friction behind the cable: 0.4 N m more than the plant's
/// 0.5, or 0.9 N m that the plant has not.
std::vector<std::string> drive_beside_loop(bool plant_has_it) {
  ravencal::physics::Plant plant;
  plant.joints.resize(1);
  plant.joints[0].name = "one";
  if (plant_has_it) plant.joints[0].effects = {{"joint_friction", {}, {{"level", 0.5}}}};
  NamedEffect loop, turn, level;
  loop.id = "joint_friction";
  turn.id = "presliding";
  level.id = "coulomb_friction";
  loop.joint = turn.joint = level.joint = "one";
  loop.stage = "transmission";
  turn.stage = level.stage = "drive";
  loop.out_of_tolerance = plant_has_it;
  loop.parameters = {{"level", 0.9, "N_m", {0.8, 1.0}}};
  turn.parameters = {{"displacement", 0.02, "rad", {0.015, 0.025}}};
  level.parameters = {{"level", plant_has_it ? 0.4 : 0.9, "N_m", {0.2, 1.0}}};
  Report report;
  report.effects = {loop, turn, level};
  merge_joint_friction(plant, report);
  std::vector<std::string> names;
  for (const NamedEffect& e : report.effects)
    if (e.stage == "drive") names.push_back(e.id);
  return names;
}

TEST(AcrossJoints, ACablesWindUpIsNoPreslidingUnlessThePlantKnowsOfIt) {
  EXPECT_EQ(drive_beside_loop(false), std::vector<std::string>{});
  EXPECT_EQ(drive_beside_loop(true), std::vector<std::string>{"presliding"});
}

TEST(FreeRunJudge, LeavesTheReportWhatScreeningMeasuredAndGivesThePlantWhatRuns) {
  NamedEffect seen;
  seen.id = "presliding";
  seen.joint = "one";
  seen.stage = "drive";
  seen.parameters = {{"displacement", 0.004, "rad", {0.003, 0.006}}};
  FreeRunVerdict verdict;
  verdict.values = {seen};
  verdict.values.front().parameters.front() = {"displacement", 0.012, "rad", {0.010, 0.015}};
  Report report;
  report.effects = {seen};
  Series drive;
  drive.joint = "one";
  apply(verdict, drive, report);
  const NamedParameter& p = report.effects.front().parameters.front();
  EXPECT_EQ(p.value, 0.004);
  EXPECT_EQ(p.ci95, seen.parameters.front().ci95);
  EXPECT_EQ(p.in_plant(), 0.012);
  // A number that screening only moved has no interval of its own.
  report.effects.front().parameters.front().ci95 = {0.004, 0.004};
  apply(verdict, drive, report);
  EXPECT_EQ(p.value, 0.012);
  EXPECT_EQ(p.ci95, verdict.values.front().parameters.front().ci95);
}

}  // namespace
