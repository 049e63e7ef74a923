// SPDX-License-Identifier: Apache-2.0
//
// What the drive's constant is taken for.
#include <gtest/gtest.h>

#include <algorithm>

#include "diagnose/diagnose.hpp"
#include "diagnose_arm.hpp"
#include "diagnose_generator.hpp"

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
  // Where the joint moves, half of the difference is a constant effort.
  const bool constant = effect.id == "effort_offset";
  EXPECT_TRUE(constant || effect.id == "asymmetric_friction") << effect.id;
  EXPECT_NEAR(effect.parameters.front().value, constant ? 0.3 : 0.6, constant ? 0.05 : 0.1);
}

TEST(DriveConstant, IsPartOfFrictionThatDiffersWithSpeedAsWell) {
  for (const double uneven_viscous : {0.2, 0.8, 1.6}) {
    const Report report = diagnosed({.uneven_n_m = 0.6, .uneven_viscous = uneven_viscous});
    ASSERT_EQ(report.effects.size(), 1U) << uneven_viscous << ": " << report.verdict.text;
    const NamedEffect& effect = report.effects.front();
    EXPECT_EQ(effect.id, "asymmetric_friction");
    EXPECT_EQ(effect.parameters.front().name, "level_difference");
    EXPECT_NEAR(effect.parameters.front().value, 0.6, 0.1) << uneven_viscous;
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

TEST(DriveConstant, OfOneRecordingMayBeAnOffsetOfTheEffort) {
  const Report report = diagnosed_with_offsets({0.3});
  ASSERT_EQ(report.effects.size(), 1U) << report.verdict.text;
  const NamedEffect& effect = report.effects.front();
  const bool or_offset =
      std::count(effect.ambiguous_with.begin(), effect.ambiguous_with.end(), "effort_offset") == 1;
  EXPECT_TRUE(effect.id == "effort_offset" || or_offset) << effect.id;
}

TEST(DriveConstant, IsNoFindingWhereFrictionIsEven) {
  const Report report = diagnosed({});
  EXPECT_TRUE(report.effects.empty()) << report.verdict.text;
}

/// The only name for joint "one", on which no load acts, that has this much of its plant's dry
/// friction and whose recorded effort is `recorded` times what it gives.
NamedEffect only_name(double friction, double recorded) {
  ravencal::record::Recording recording =
      ravencal::generator::make_recording({.coulomb_n_m = 0.5 * friction, .viscous_n_m_s = 4.0},
                                          {.seed = 9, .duration_s = 240.0, .with_truth = false});
  recording.samples.col(2) *= recorded;
  const auto plant = ravencal::physics::parse_plant(
      ravencal::generator::plant_text(
          "\n  [[joint.effect]]\n  id = \"coulomb_friction\"\n  level_n_m = 0.5\n"
          "\n  [[joint.effect]]\n  id = \"viscous_friction\"\n  damping_n_m_s_per_rad = 4.0\n"),
      "test plant");
  Options options;
  options.threads = 1;
  const auto report = diagnose({recording}, {}, plant.value(), options);
  EXPECT_TRUE(report.ok() && report->effects.size() == 1U)
      << (report.ok() ? report->verdict.text : report.error().message);
  return report.ok() && !report->effects.empty() ? report->effects.front() : NamedEffect{};
}

TEST(TorqueConstant, IsWrongWhereAllOfTheDrivesNumbersAreWrongAlike) {
  const NamedEffect weak = only_name(1.0, 0.7);
  EXPECT_EQ(weak.id, "torque_constant");
  ASSERT_FALSE(weak.parameters.empty());
  EXPECT_NEAR(weak.parameters.front().value, 1.0 / 0.7 - 1.0, 0.1);
  const NamedEffect smooth = only_name(0.6, 1.0);
  EXPECT_EQ(smooth.id, "coulomb_friction");
  EXPECT_TRUE(smooth.out_of_tolerance);
}

}  // namespace
