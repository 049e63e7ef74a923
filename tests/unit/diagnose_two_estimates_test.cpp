// SPDX-License-Identifier: Apache-2.0
//
// Numbers of a drive by two estimators, on the arm of diagnose_arm.hpp, which shares no physics
// with diagnose.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "diagnose/diagnose.hpp"
#include "diagnose_arm.hpp"

namespace ravencal::diagnose {
namespace {

Report report_of(record::Recording recording) {
  const auto plant = physics::parse_plant(generator::arm_plant(), "one joint");
  EXPECT_TRUE(plant.ok());
  auto report = diagnose({std::move(recording)}, {}, *plant, {});
  EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
  return std::move(report).value();
}

TEST(DiagnoseTwoEstimates, AgreeWhereThePlantHasTheRobotsLaws) {
  const Report report = report_of(
      generator::record_arm({}, {.seed = 4, .duration_s = 160.0, .rate_hz = 100.0, .rich = true}));
  ASSERT_GE(report.two_estimates.size(), 2U);
  for (const TwoEstimates& e : report.two_estimates) {
    EXPECT_TRUE(e.agree) << e.id << " " << e.parameter << " " << e.equation_error << " "
                         << e.free_run;
    EXPECT_LT(e.equation_error_ci95.first, e.equation_error);
    EXPECT_LT(e.free_run, e.free_run_ci95.second);
    EXPECT_LE(std::abs(e.free_run - e.equation_error), e.allowed) << e.id << " " << e.parameter;
  }
}

/// Friction that changes slowly along the joint passes for friction by the load, which changes
/// along it too.
TEST(DiagnoseTwoEstimates, PartWhereAnotherLawPassesForTheRobots) {
  record::Recording recording =
      generator::record_arm({}, {.seed = 5, .duration_s = 160.0, .rate_hz = 100.0, .rich = true});
  auto effort = recording.samples.col(*recording.column(record::Role::kDriveTorque, "elbow"));
  const Eigen::VectorXd q =
      recording.samples.col(*recording.column(record::Role::kMotorPosition, "elbow")) / 121.5;
  for (Eigen::Index i = 1; i + 1 < effort.size(); ++i) {
    const double velocity_rad_per_s = 50.0 * (q[i + 1] - q[i - 1]);
    effort[i] *= 1.0 + 0.4 * std::sin(2.0 * q[i]) * std::tanh(velocity_rad_per_s / 0.01);
  }
  const Report report = report_of(std::move(recording));
  const auto parted = std::find_if(report.two_estimates.begin(), report.two_estimates.end(),
                                   [](const TwoEstimates& e) { return !e.agree; });
  ASSERT_NE(parted, report.two_estimates.end()) << report.verdict.text;
  EXPECT_GT(std::abs(parted->free_run - parted->equation_error), parted->allowed);
  EXPECT_NE(report.verdict.text.find("by the motion under the recorded efforts"), std::string::npos)
      << report.verdict.text;
}

}  // namespace
}  // namespace ravencal::diagnose
