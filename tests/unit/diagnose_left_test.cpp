// SPDX-License-Identifier: Apache-2.0
//
// The absolute alarm: it rings on physics that no word of the vocabulary says, and is silent on
// noise.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "diagnose/diagnose.hpp"
#include "diagnose_generator.hpp"

namespace ravencal::diagnose {
namespace {

Report report_of(const record::Recording& recording) {
  const auto plant = physics::parse_plant(generator::plant_text(), "test plant");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  Options options;
  options.threads = 1;
  auto report = diagnose({recording}, {}, plant.value(), options);
  EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
  return report.value();
}

/// The other joint's direction brakes the drive of the first: no word says so, and no learner is
/// shown another joint's rate.
record::Recording braked_by_the_other(double level_n_m) {
  record::Recording recording = generator::make_recording({}, {.seed = 5});
  constexpr Eigen::Index kOther = 1, kTorque = 3, kReach = 3;
  for (Eigen::Index i = kReach; i + kReach < recording.samples.rows(); ++i) {
    const double moved =
        recording.samples(i + kReach, kOther) - recording.samples(i - kReach, kOther);
    recording.samples(i, kTorque) += level_n_m * std::tanh(moved / 1e-3);
  }
  return recording;
}

TEST(ErrorLeft, RingsOnPhysicsThatNoCandidateCanExpress) {
  const Report report = report_of(braked_by_the_other(0.2));
  EXPECT_EQ(report.verdict.kind, "unexplained") << report.verdict.text;
  bool rings = false;
  for (const ErrorLeft& e : report.left) {
    if (e.stage != "drive") continue;
    rings = !e.reached;
    EXPECT_EQ(e.measured_by, "repetition");
    EXPECT_GT(e.share(), 0.5);
  }
  EXPECT_TRUE(rings);
  EXPECT_EQ(report.verdict.text.rfind("Joint one, drive: ", 0), 0U) << report.verdict.text;
  EXPECT_NE(report.verdict.text.find("of the squared error is left and has no name"),
            std::string::npos)
      << report.verdict.text;
}

TEST(ErrorLeft, StaysSilentWithoutItAndSaysWhatThatRestsOn) {
  const Report report = report_of(braked_by_the_other(0.0));
  EXPECT_EQ(report.verdict.kind, "nothing_left_out") << report.verdict.text;
  ASSERT_EQ(report.left.size(), 2U);
  for (const ErrorLeft& e : report.left) EXPECT_EQ(e.measured_by, "repetition") << e.stage;
  EXPECT_NE(report.verdict.text.find("Passes in the same circumstances judged 2 of 2 channels."),
            std::string::npos)
      << report.verdict.text;
}

}  // namespace
}  // namespace ravencal::diagnose
