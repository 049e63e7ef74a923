// SPDX-License-Identifier: Apache-2.0
//
// What the drive's constant is taken for.
#include <gtest/gtest.h>

#include <algorithm>

#include "diagnose/diagnose.hpp"
#include "diagnose_arm.hpp"

namespace {

using namespace ravencal::diagnose;

Report diagnosed(const ravencal::generator::ArmTruth& truth,
                 const ravencal::generator::ArmScene& scene, const std::string& concealed) {
  const auto plant =
      ravencal::physics::parse_plant(ravencal::generator::arm_plant(concealed), "test plant");
  EXPECT_TRUE(plant.ok());
  Options options;
  options.threads = 1;
  const auto recording = ravencal::generator::record_arm(truth, scene);
  auto report = diagnose({recording}, {}, plant.value(), options);
  EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
  return report.value();
}

/// The arm of that truth, recorded once per constant effort.
Report diagnosed_with_offsets(const std::vector<double>& offsets_n_m) {
  const auto plant = ravencal::physics::parse_plant(ravencal::generator::arm_plant(), "test plant");
  EXPECT_TRUE(plant.ok());
  std::vector<ravencal::record::Recording> recordings;
  for (const double offset : offsets_n_m) {
    recordings.push_back(ravencal::generator::record_arm({}, {.seed = 2 + recordings.size(),
                                                              .duration_s = 120.0,
                                                              .rate_hz = 50.0,
                                                              .rich = true,
                                                              .deviation = 0.0}));
    const auto torque = recordings.back().column(ravencal::record::Role::kDriveTorque, "elbow");
    recordings.back().samples.col(*torque).array() += offset;
  }
  Options options;
  options.threads = 1;
  auto report = diagnose(recordings, {}, plant.value(), options);
  EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
  return report.value();
}

Report diagnosed(const ravencal::generator::ArmTruth& truth) {
  return diagnosed(
      truth, {.seed = 2, .duration_s = 120.0, .rate_hz = 50.0, .rich = true, .deviation = 0.03},
      {});
}

TEST(AcrossJoints, AMotorsLittleFrictionIsNotTheJoints) {
  // Slow motion and less of it than of the joint's own, which could be so much more but for the
  // loop of the cable.
  for (const std::uint64_t seed : {2, 3}) {
    const Report report =
        diagnosed({.motor_friction = 0.25},
                  {.seed = seed, .duration_s = 120.0, .rate_hz = 50.0, .deviation = 0.03},
                  "coulomb_friction");
    ASSERT_EQ(report.effects.size(), 1U) << report.verdict.text;
    const NamedEffect& effect = report.effects.front();
    EXPECT_EQ(effect.id, "coulomb_friction") << report.verdict.text;
    EXPECT_FALSE(effect.out_of_tolerance);
    EXPECT_NEAR(effect.parameters.front().value, 0.25, 0.05);
  }
}

TEST(DriveConstant, IsFrictionThatDiffersBetweenTheDirections) {
  const Report report = diagnosed({.uneven_n_m = 0.6});
  ASSERT_EQ(report.effects.size(), 1U) << report.verdict.text;
  const NamedEffect& effect = report.effects.front();
  EXPECT_EQ(effect.id, "asymmetric_friction");
  EXPECT_EQ(effect.parameters.front().name, "level_difference");
  EXPECT_NEAR(effect.parameters.front().value, 0.6, 0.1);
}

TEST(DriveConstant, IsPartOfFrictionThatDiffersWithSpeedAsWell) {
  // What speed adds is too little to be told, kept without a name, named.
  for (const double uneven_viscous : {0.2, 0.8, 1.6}) {
    const Report report = diagnosed({.uneven_n_m = 0.6, .uneven_viscous = uneven_viscous});
    ASSERT_EQ(report.effects.size(), 1U) << uneven_viscous << ": " << report.verdict.text;
    const NamedEffect& effect = report.effects.front();
    EXPECT_EQ(effect.id, "asymmetric_friction");
    const NamedParameter* level = find_parameter(effect, "level_difference");
    ASSERT_NE(level, nullptr) << uneven_viscous;
    EXPECT_NEAR(level->value, 0.6, 0.1) << uneven_viscous;
    EXPECT_EQ(effect.parameters.size(), uneven_viscous > 0.5 ? 2U : 1U) << uneven_viscous;
  }
}

TEST(DriveConstant, IsFrictionBesideALoadWhoseMeanTheGeometryKnows) {
  for (const double uneven_n_m : {0.8, 0.0}) {
    const Report report = diagnosed({.payload_kg = 0.5, .uneven_n_m = uneven_n_m});
    const auto uneven =
        std::count_if(report.effects.begin(), report.effects.end(),
                      [](const NamedEffect& e) { return e.id == "asymmetric_friction"; });
    EXPECT_EQ(uneven, uneven_n_m > 0.0 ? 1 : 0) << report.verdict.text;
    EXPECT_EQ(report.effects.size(), 1U + uneven) << report.verdict.text;
  }
}

TEST(DriveConstant, OfOneRecordingIsFrictionOrAnOffsetOfTheEffort) {
  const Report report = diagnosed_with_offsets({0.3});
  ASSERT_EQ(report.effects.size(), 1U) << report.verdict.text;
  const NamedEffect& effect = report.effects.front();
  EXPECT_EQ(effect.id, "asymmetric_friction");
  EXPECT_EQ(std::count(effect.ambiguous_with.begin(), effect.ambiguous_with.end(), "effort_offset"),
            1);
  EXPECT_LE(effect.probability, 0.5) << "the two share it";
}

TEST(DriveConstant, ThatDiffersBetweenRecordingsIsAnOffsetOfTheEffort) {
  const Report report = diagnosed_with_offsets({0.3, -0.3});
  ASSERT_EQ(report.effects.size(), 1U) << report.verdict.text;
  const NamedEffect& effect = report.effects.front();
  EXPECT_EQ(effect.id, "effort_offset");
  EXPECT_NEAR(effect.parameters.front().value, 0.3 * 121.5 / 12.25, 0.1) << "at the joint";
}

TEST(DriveConstant, IsNoFindingWhereFrictionIsEven) {
  const Report report = diagnosed({});
  EXPECT_TRUE(report.effects.empty()) << report.verdict.text;
}

}  // namespace
