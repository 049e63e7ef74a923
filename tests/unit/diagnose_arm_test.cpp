// SPDX-License-Identifier: Apache-2.0
//
// Names on a joint whose microphysics the plant does not share: what the gates are for.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "diagnose/diagnose.hpp"
#include "diagnose_arm.hpp"

namespace {

using namespace ravencal;
using generator::ArmScene;
using generator::ArmTruth;

diagnose::Report run(const ArmTruth& truth, const ArmScene& scene,
                     const std::string& concealed = {}) {
  const auto plant = physics::parse_plant(generator::arm_plant(concealed), "test plant");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  diagnose::Options options;
  options.threads = 1;
  auto report =
      diagnose::diagnose({generator::record_arm(truth, scene)}, {}, plant.value(), options);
  EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
  return report.value();
}

std::string names_in(const diagnose::Report& report) {
  std::string names;
  for (const auto& e : report.effects) names += e.joint + "/" + e.stage + "/" + e.id + " ";
  return names + report.verdict.text;
}

bool says(const diagnose::NamedEffect& e, const std::string& id) {
  return e.id == id ||
         std::find(e.ambiguous_with.begin(), e.ambiguous_with.end(), id) != e.ambiguous_with.end();
}

struct Recovery {
  const char* id;
  ArmTruth truth;
  double value;  ///< of the first parameter; 0: not checked
  const char* concealed;
};

class NamesOnTheArm : public ::testing::TestWithParam<Recovery> {};

TEST_P(NamesOnTheArm, WhatThePlantLacksAndNothingElse) {
  const Recovery& c = GetParam();
  const diagnose::Report report = run(c.truth, {.seed = 11}, c.concealed);
  ASSERT_EQ(report.effects.size(), 1U) << names_in(report);
  EXPECT_TRUE(says(report.effects.front(), c.id)) << names_in(report);
  if (c.value != 0.0 && report.effects.front().id == c.id) {
    EXPECT_NEAR(report.effects.front().parameters.front().value, c.value, 0.2 * std::abs(c.value));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Diagnose, NamesOnTheArm,
    ::testing::Values(Recovery{"gain_error", {.gain = 0.008}, 0.008, ""},
                      Recovery{"backlash", {.gap_half_rad = 0.0035}, 0.0035, ""},
                      Recovery{"joint_friction", {.joint_friction = 1.2}, 1.2, "joint_friction"},
                      Recovery{"compliance", {.stiffness = 320.0}, 1.0 / 320.0, "compliance"},
                      Recovery{"delay", {.delay_s = 0.025}, 0.025, ""},
                      Recovery{"eccentricity", {.run_out_rad = 0.0021}, 0.0021, ""},
                      Recovery{"slip", {.slip_rad = 0.0035}, 0.0035, ""},
                      Recovery{"lost_counts", {.lost_rad = 0.0035}, -0.0035, ""},
                      Recovery{"homing_offset", {.offset_rad = 0.02}, 0.02, ""},
                      Recovery{"coulomb_friction", {}, 2.5, "coulomb_friction"},
                      Recovery{"payload", {.payload_kg = 0.4}, 0.0, ""}),
    [](const auto& test) { return std::string(test.param.id); });

/// Friction behind a cable is friction of the drive until the cable yields.
TEST(DiagnoseArm, NamesWhatStandsBehindAnotherEffectThatThePlantLacksToo) {
  std::string text = generator::arm_plant("joint_friction");
  text.erase(text.find("\n  [[joint.effect]]\n  id = \"compliance\""));
  const auto plant = physics::parse_plant(text, "stiff");
  ASSERT_TRUE(plant.ok()) << plant.error().message;
  const auto found = diagnose::diagnose(
      {generator::record_arm({.joint_friction = 1.2}, {.seed = 11, .rich = true})}, {},
      plant.value(), {});
  ASSERT_TRUE(found.ok()) << found.error().message;
  ASSERT_EQ(found->effects.size(), 2U) << names_in(*found);
  for (const diagnose::NamedEffect& effect : found->effects)
    EXPECT_TRUE(effect.id == "compliance" || effect.id == "joint_friction") << names_in(*found);
}

TEST(DiagnoseArm, StaysSilentWhereNothingIsLeftOut) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const diagnose::Report report = run({}, {.seed = 100 + seed, .rich = seed % 2 == 0});
    EXPECT_EQ(report.verdict.kind, "nothing_left_out")
        << "seed " << seed << ": " << names_in(report);
  }
}

TEST(DiagnoseArm, FindsSlipsAboveTheirDetectionLimitOnly) {
  const ArmScene scene{.seed = 11};
  const diagnose::Report silent = run({}, scene);
  const auto limit = std::find_if(silent.not_found.begin(), silent.not_found.end(),
                                  [](const diagnose::NotFound& n) { return n.id == "slip"; });
  ASSERT_NE(limit, silent.not_found.end());
  ASSERT_TRUE(limit->detection_limit.has_value()) << limit->not_testable_because;
  const auto finds = [&](double times) {
    const diagnose::Report report = run({.slip_rad = times * *limit->detection_limit}, scene);
    return std::any_of(report.effects.begin(), report.effects.end(),
                       [](const diagnose::NamedEffect& e) { return says(e, "slip"); });
  };
  EXPECT_TRUE(finds(1.5));
  // The limit is that of a step anywhere; one at half time bends the whole recording, and its
  // likelihood tells of less.
  EXPECT_FALSE(finds(0.2));
}

TEST(DiagnoseArm, WritesTheWeightThatItFoundIntoThePlant) {
  const auto plant = physics::parse_plant(generator::arm_plant(), "one joint");
  ASSERT_TRUE(plant.ok());
  const ArmTruth truth{.weight_n_m = 1.6 * 2.06};
  const auto found = diagnose::diagnose(
      {generator::record_arm(truth, {.seed = 11, .deviation = 0.0})}, {}, plant.value(), {});
  ASSERT_TRUE(found.ok());
  const diagnose::Report& report = found.value();
  ASSERT_EQ(report.effects.size(), 1U) << names_in(report);
  const diagnose::NamedEffect& weight = report.effects.front();
  ASSERT_EQ(weight.id, "gravity") << names_in(report);
  EXPECT_TRUE(weight.out_of_tolerance);
  EXPECT_TRUE(says(weight, "payload"));
  EXPECT_NEAR(weight.parameters.front().value, 0.6, 0.15);
  EXPECT_NEAR(report.improved.joints[0].link.mass_kg, 0.96, 0.09);
}

/// One joint feels a weight at the tool as it feels a heavier link.
TEST(DiagnoseArm, DoesNotTellALoadOfTheLinksOwnSizeFromAHeavierLink) {
  const diagnose::Report report = run({.payload_kg = 0.6}, {.seed = 11});
  ASSERT_EQ(report.effects.size(), 1U) << names_in(report);
  EXPECT_TRUE(says(report.effects.front(), "payload")) << names_in(report);
  EXPECT_TRUE(says(report.effects.front(), "gravity")) << names_in(report);
}

TEST(DiagnoseArm, DoesNotTellTheWeightOfALinkThatHasNoneInThePlantFromAPayload) {
  std::string text = generator::arm_plant();
  text.replace(text.find("mass_kg = 0.6"), 13, "mass_kg = 0.0");
  const auto plant = physics::parse_plant(text, "weightless");
  ASSERT_TRUE(plant.ok()) << plant.error().message;
  const auto found = diagnose::diagnose({generator::record_arm({}, {.seed = 11, .deviation = 0.0})},
                                        {}, plant.value(), {});
  ASSERT_TRUE(found.ok()) << found.error().message;
  ASSERT_EQ(found->effects.size(), 1U) << names_in(*found);
  EXPECT_TRUE(says(found->effects.front(), "payload")) << names_in(*found);
  EXPECT_TRUE(says(found->effects.front(), "gravity")) << names_in(*found);
}

/// Friction behind the cable that the joint's loop names loads the drive as well: one cause.
TEST(DiagnoseArm, NamesFrictionBehindTheCableOnceThoughTwoChannelsShowIt) {
  struct Off {
    double level_n_m;
    ArmScene scene;
  };
  for (const Off& off : {Off{0.225, {.seed = 1}}, Off{1.2, {.seed = 2, .rich = true}}}) {
    const auto report = run({.joint_friction = off.level_n_m}, off.scene);
    ASSERT_EQ(report.effects.size(), 1U) << names_in(report);
    EXPECT_EQ(report.effects.front().id, "joint_friction") << names_in(report);
    EXPECT_TRUE(report.effects.front().out_of_tolerance);
    EXPECT_TRUE(report.unexplained.empty()) << names_in(report);
    for (const diagnose::HeldOut& h : report.held_out) {
      if (h.metric == "effort_rmse") {
        EXPECT_LT(h.after, 1.5 * h.floor.value()) << h.before;
      }
    }
  }
}

TEST(DiagnoseArm, CallsFrictionWrongWhereAMotorWouldExplainPartOfIt) {
  struct Off {
    double factor;
    ArmScene scene;
  };
  for (const Off& off : {Off{0.6, {.seed = 1}}, Off{1.7, {.seed = 5, .rich = true}}}) {
    const auto report = run({.motor_friction = 2.5 * off.factor}, off.scene);
    ASSERT_EQ(report.effects.size(), 1U) << names_in(report);
    const diagnose::NamedEffect& effect = report.effects.front();
    EXPECT_EQ(effect.id, "coulomb_friction") << names_in(report);
    EXPECT_TRUE(effect.out_of_tolerance);
  }
}

/// Far from the joint's zero a wrong ratio is mostly a constant, but not only.
TEST(DiagnoseArm, TellsAWrongRatioFromAHomingOffsetFarFromZero) {
  constexpr double kFar_rad = 1.2;
  constexpr double kReduction = 121.5;
  const auto plant = physics::parse_plant(generator::arm_plant({}, -kFar_rad), "test plant");
  ASSERT_TRUE(plant.ok());
  const auto name_of = [&](const ArmTruth& truth) {
    record::Recording recording = generator::record_arm(truth, {.seed = 11});
    recording.samples.col(0).array() += kFar_rad;
    recording.samples.col(1).array() += kFar_rad * kReduction;
    recording.samples.col(2).array() += kFar_rad;
    const auto report = diagnose::diagnose({recording}, {}, plant.value(), {});
    EXPECT_TRUE(report.ok());
    return report->effects.size() == 1 ? report->effects.front().id : names_in(report.value());
  };
  for (const double ratio : {-0.0016, 0.0016}) {
    EXPECT_EQ(name_of({.gain = ratio, .offset_rad = ratio * kFar_rad}), "gain_error");
    EXPECT_EQ(name_of({.offset_rad = ratio * kFar_rad}), "homing_offset");
  }
}

TEST(DiagnoseArm, SaysUnknownOfABumpThatNoEffectMakes) {
  const diagnose::Report report = run({.bump_rad = 0.004}, {.seed = 5});
  EXPECT_FALSE(report.unexplained.empty()) << names_in(report);
}

}  // namespace
