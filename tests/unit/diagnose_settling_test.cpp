// SPDX-License-Identifier: Apache-2.0
//
// Rows that no law covers: the few where something else happened, and those of a joint at rest.
#include <gtest/gtest.h>

#include <cmath>

#include "diagnose_generated.hpp"

namespace ravencal::diagnose {
namespace {

using record::Role;

const NamedEffect* find(const Report& report, const std::string& id) {
  for (const NamedEffect& e : report.effects)
    if (e.id == id && e.joint == "one") return &e;
  return nullptr;
}

generator::Scene scene() {
  generator::Scene scene;
  scene.seed = 5;
  scene.duration_s = 240.0;
  scene.with_torque = false;
  return scene;
}

generator::HiddenPhysics coupled() {
  generator::HiddenPhysics hidden;
  hidden.coupling = 0.004;
  return hidden;
}

/// The truth is off by `size_rad` for `rows` rows at each of these shares of the recording.
record::Recording with_gross_rows(std::initializer_list<double> shares, Eigen::Index rows,
                                  double size_rad) {
  auto recording = generator::make_recording(coupled(), scene());
  const auto truth = *recording.column(Role::kJointTruth, "one");
  for (const double share : shares) {
    const auto first = static_cast<Eigen::Index>(share * static_cast<double>(recording.rows()));
    recording.samples.col(truth).segment(first, rows).array() += size_rad;
  }
  return recording;
}

TEST(GrossRows, DoNotHideWhatTheOthersShowAndAreReported) {
  const auto report = diagnosed(with_gross_rows({0.31, 0.72}, 20, 0.2));
  const NamedEffect* coupling = find(report, "coupling");
  ASSERT_NE(coupling, nullptr) << report.verdict.text;
  EXPECT_NEAR(coupling->parameters.front().value, 0.004, 0.001);
  EXPECT_NE(report.verdict.text.find("rows in 2 stretches"), std::string::npos)
      << report.verdict.text;
}

TEST(GrossRows, ThatRepeatAreLeftAsTheyAre) {
  const auto report =
      diagnosed(with_gross_rows({0.11, 0.22, 0.33, 0.44, 0.55, 0.66, 0.77, 0.88}, 8, 0.2));
  EXPECT_EQ(report.verdict.text.find("stretches, the first"), std::string::npos)
      << report.verdict.text;
}

TEST(GrossRows, AreNotFoundInACleanRecording) {
  const auto report = diagnosed(generator::make_recording(coupled(), scene()));
  EXPECT_EQ(report.verdict.text.find("stretches, the first"), std::string::npos)
      << report.verdict.text;
}

/// A joint that rests half of the time; at rest its drive carries `share` of its friction.
record::Recording resting(double share) {
  record::Recording r;
  r.channels = {{"q", "rad", Role::kMotorPosition, "one"},
                {"q2", "rad", Role::kMotorPosition, "two"},
                {"tau", "N_m", Role::kDriveTorque, "one"}};
  constexpr Eigen::Index kRows = 12'000;
  r.samples.resize(kRows, 3);
  r.source = "resting";
  constexpr double kPi = 3.14159265358979;
  double q = 0.0;
  std::uint32_t noise = 7;
  for (Eigen::Index i = 0; i < kRows; ++i) {
    const double t_s = 0.01 * static_cast<double>(i);
    const double phase = std::fmod(t_s, 8.0);
    const double side = phase < 4.0 ? 1.0 : -1.0;
    const double moving = std::fmod(phase, 4.0);
    const bool rests = moving >= 2.0;
    // Every pass has its own speed.
    const double speed = 0.1 + 0.03 * std::fmod(std::floor(t_s / 8.0) * 3.0, 7.0);
    const double v = rests ? 0.0 : side * speed * std::pow(std::sin(0.5 * kPi * moving), 2);
    const double a = rests ? 0.0 : side * speed * 0.5 * kPi * std::sin(kPi * moving);
    noise = noise * 1664525U + 1013904223U;
    const double n = (static_cast<double>(noise >> 8) / 16777216.0 - 0.5) * 0.1;
    r.t_ns.push_back(10'000'000LL * i);
    r.samples.row(i) << q, 0.1 * std::sin(t_s), 2.0 * a + (rests ? share : 1.0) * side + n;
    q += 0.01 * v;
  }
  return r;
}

TEST(Rest, TakesOfFrictionWhatIsLeftThere) {
  const auto report = diagnosed(resting(0.4));
  ASSERT_NE(find(report, "coulomb_friction"), nullptr) << report.verdict.text;
  EXPECT_NE(report.verdict.text.find("at rest, joint one carries "), std::string::npos)
      << report.verdict.text;
}

TEST(Rest, SaysNothingWhereFrictionStays) {
  const auto report = diagnosed(resting(1.0));
  EXPECT_EQ(report.verdict.text.find("at rest, joint one"), std::string::npos)
      << report.verdict.text;
}

}  // namespace
}  // namespace ravencal::diagnose
