// SPDX-License-Identifier: Apache-2.0
//
// One small recording for each way in which a name was once wrong or missing.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "diagnose/diagnose.hpp"
#include "diagnose_generator.hpp"

namespace {

using namespace ravencal;
using Eigen::Index;

physics::Plant plant_of(const std::string& head, const std::string& effects = {}) {
  auto plant = physics::parse_plant(head + generator::plant_text(effects), "test plant");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  return plant.value();
}

diagnose::Report run(const record::Recording& recording, const physics::Plant& plant) {
  diagnose::Options options;
  options.threads = 1;
  auto report = diagnose::diagnose({recording}, {}, plant, options);
  EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
  return report.value();
}

std::string names_in(const diagnose::Report& report) {
  std::string names;
  for (const auto& e : report.effects) names += e.joint + "/" + e.stage + "/" + e.id + " ";
  return names + report.verdict.text;
}

class Inherited : public ::testing::TestWithParam<double> {};

/// Joint "one" has a gap. How much of its error arrives in joint "two", whose cable passes it, is
/// the mechanism's matter: none, half or all of it is no effect of joint "two".
TEST_P(Inherited, ErrorsOfAnotherJointAreNoEffectOfThisOne) {
  constexpr double kCoupling = -0.3;
  record::Recording recording =
      generator::make_recording({.gap_half_rad = 0.006}, {.seed = 5, .with_torque = false});
  const Index rows = recording.samples.rows();
  const Eigen::VectorXd error = recording.samples.col(2) - recording.samples.col(0);
  std::mt19937_64 engine(9);
  recording.channels.push_back({"two.truth", "rad", record::Role::kJointTruth, "two"});
  recording.samples.conservativeResize(Eigen::NoChange, 4);
  for (Index i = 0; i < rows; ++i) {
    const double white = 3e-4 * (static_cast<double>(engine() >> 11U) * 0x1.0p-53 - 0.5);
    recording.samples(i, 3) = recording.samples(i, 1) + GetParam() * kCoupling * error[i] + white;
  }
  const auto report = run(recording, plant_of("coupling = [[0.0, 0.0], [-0.3, 0.0]]\n"));
  for (const auto& e : report.effects) EXPECT_EQ(e.joint, "one") << names_in(report);
  EXPECT_FALSE(report.effects.empty());
}

INSTANTIATE_TEST_SUITE_P(Diagnose, Inherited, ::testing::Values(0.0, 0.5, 1.0),
                         [](const auto& test) {
                           return std::to_string(std::lround(100.0 * test.param)) + "Percent";
                         });

TEST(Causes, DriftOfThreeMinutesIsNamedAndNotTakenForNoise) {
  record::Recording recording =
      generator::make_recording({}, {.seed = 6, .duration_s = 200.0, .with_torque = false});
  for (Index i = 0; i < recording.samples.rows(); ++i) {
    const double t_s = static_cast<double>(recording.t_ns[static_cast<std::size_t>(i)]) * 1e-9;
    recording.samples(i, 2) += 0.004 * (1.0 - std::exp(-t_s / 60.0));
  }
  const auto report = run(recording, plant_of(""));
  ASSERT_EQ(report.effects.size(), 1U) << names_in(report);
  EXPECT_EQ(report.effects.front().id, "thermal_drift") << names_in(report);
}

TEST(Causes, FrictionThatFadesWithTimeIsUnknownAndDependsOnTime) {
  record::Recording recording = generator::make_recording(
      {.coulomb_n_m = 0.5}, {.seed = 7, .duration_s = 240.0, .with_truth = false});
  for (Index i = 1; i < recording.samples.rows(); ++i) {
    const double t_s = static_cast<double>(recording.t_ns[static_cast<std::size_t>(i)]) * 1e-9;
    const double moved = recording.samples(i, 0) - recording.samples(i - 1, 0);
    recording.samples(i, 2) += 0.6 * std::exp(-t_s / 60.0) * (moved > 0.0 ? 1.0 : -1.0);
  }
  const auto report =
      run(recording,
          plant_of("", "\n  [[joint.effect]]\n  id = \"coulomb_friction\"\n  level_n_m = 0.5\n"));
  ASSERT_FALSE(report.unexplained.empty()) << names_in(report);
  const auto& on = report.unexplained.front().depends_on;
  EXPECT_TRUE(std::any_of(on.begin(), on.end(), [](const std::string& circumstance) {
    return circumstance.find("time") != std::string::npos;
  })) << names_in(report);
}

TEST(Unknown, IsAToneThoughItShakesTheJointAsWell) {
  // A drive that hums moves its joint a little; its desired path knows nothing of that.
  record::Recording recording = generator::make_recording(
      {.coulomb_n_m = 0.5}, {.seed = 7, .duration_s = 240.0, .with_truth = false});
  const Index rows = recording.samples.rows();
  const Eigen::VectorXd path = recording.samples.col(0);
  for (Index i = 0; i < rows; ++i) {
    const double t_s = static_cast<double>(recording.t_ns[static_cast<std::size_t>(i)]) * 1e-9;
    const double tone = std::sin(2.0 * 3.14159265 * 0.9 * t_s);
    recording.samples(i, 0) += 3e-3 * tone;
    recording.samples(i, 2) += 0.8 * tone;
  }
  recording.channels.push_back({"one.desired", "rad", record::Role::kDesiredPosition, "one"});
  recording.samples.conservativeResize(Eigen::NoChange, recording.samples.cols() + 1);
  recording.samples.rightCols(1) = path;
  const auto plant = physics::parse_plant(
      generator::plant_text(
          "\n  [[joint.effect]]\n  id = \"coulomb_friction\"\n  level_n_m = 0.5\n"),
      "test plant");
  ASSERT_TRUE(plant.ok());
  diagnose::Options options;
  options.threads = 1;
  const auto report = diagnose::diagnose({recording}, {}, plant.value(), options);
  ASSERT_TRUE(report.ok()) << report.error().message;
  ASSERT_FALSE(report->unexplained.empty()) << report->verdict.text;
  EXPECT_EQ(report->unexplained.front().depends_on.front(), "time, at 0.9 Hz")
      << report->verdict.text;
}

}  // namespace
