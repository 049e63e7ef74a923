// SPDX-License-Identifier: Apache-2.0
//
// Dry friction as the drive's channel takes it from the recorded motion: over reversals, over
// speed, behind cables that other joints wind, under loads that the plant lacks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/shapes.hpp"
#include "diagnose_form.hpp"
#include "diagnose_two_joints.hpp"
#include "record/recording.hpp"

namespace {

using namespace ravencal;
using diagnose::Series;
using Eigen::Index;
using Eigen::VectorXd;

constexpr double kStep_s = 0.005;
constexpr double kLevel = 1.5;
constexpr double kBehind = 0.5;
constexpr double kCoupling = generator::kTwoJointCoupling;

double triangle(double t_s, double amplitude, double period_s) {
  const double phase = std::fmod(t_s, period_s) / period_s;
  return amplitude * (phase < 0.5 ? 4.0 * phase - 1.0 : 3.0 - 4.0 * phase);
}

physics::Plant two_joints() {
  return generator::two_joints(
      "  [[joint.effect]]\n  id = \"joint_friction\"\n  level_n_m = 0.5\n"
      "  presliding_rad = 0.0002\n");
}

/// The second motor creeps while the first one moves ten times as fast.
record::Recording coupled_motion() {
  using record::Role;
  record::Recording r;
  r.source = "generated";
  for (const std::string name : {"one", "two"}) {
    r.channels.push_back({name + ".motor", "rad", Role::kMotorPosition, name});
    r.channels.push_back({name + ".torque", "N_m", Role::kDriveTorque, name});
  }
  constexpr Index kRows = 12000;
  r.samples.resize(kRows, 4);
  for (Index i = 0; i < kRows; ++i) {
    const double t_s = kStep_s * static_cast<double>(i);
    r.t_ns.push_back(static_cast<std::int64_t>(i) * 5'000'000);
    r.samples.row(i) << 100.0 * triangle(t_s, 0.5, 6.0), 0.0, 100.0 * triangle(t_s, 0.25, 30.0),
        0.0;
  }
  return r;
}

const Series& drive_of(const diagnose::SeriesSet& set, const std::string& joint) {
  return *std::find_if(set.series.begin(), set.series.end(), [&](const Series& s) {
    return s.joint == joint && s.stage == diagnose::Stage::kDrive;
  });
}

TEST(DriveFriction, BehindACableTurnsWithTheJointAndLoadsTheMotorThatWindsIt) {
  const physics::Plant plant = two_joints();
  const auto set = diagnose::build_series({coupled_motion()}, {}, plant, {});
  ASSERT_TRUE(set.ok()) << set.error().message;
  const Series& one = drive_of(*set, "one");
  const Series& two = drive_of(*set, "two");
  const VectorXd on_one = diagnose::nominal_of(one, plant).prediction;
  const VectorXd on_two = diagnose::nominal_of(two, plant).prediction;
  const double ramp_s = 2.0 * std::max(one.motion.half_width_s, two.motion.half_width_s);
  int opposed = 0;
  for (Index i = 200; i + 200 < one.rows(); ++i) {
    // Away from both motors' reversals.
    const double since_one = std::fmod(one.t_s[i], 3.0);
    const double since_two = std::fmod(one.t_s[i], 15.0);
    if (since_one < ramp_s || since_one > 3.0 - ramp_s) continue;
    if (since_two < ramp_s || since_two > 15.0 - ramp_s) continue;
    const double motor_one = std::copysign(1.0, one.motion.v[i]);
    const double motor_two = std::copysign(1.0, two.motion.v[i]);
    const double joint_two = std::copysign(1.0, two.motion.v[i] + kCoupling * one.motion.v[i]);
    opposed += joint_two != motor_two ? 1 : 0;
    EXPECT_NEAR(on_two[i], kLevel * motor_two + kBehind * joint_two, 0.05) << one.t_s[i];
    EXPECT_NEAR(on_one[i], (kLevel + kBehind) * motor_one + kCoupling * kBehind * joint_two, 0.05)
        << one.t_s[i];
  }
  EXPECT_GT(opposed, 1000);
}

/// One passage from -0.01 to 0.01 rad and back at 0.02 rad/s.
Series there_and_back() {
  Series s;
  s.stage = diagnose::Stage::kDrive;
  s.presliding = 5e-4;
  const Index rows = 400;
  s.t_s = VectorXd::LinSpaced(rows, 0.0, kStep_s * static_cast<double>(rows - 1));
  s.y = s.motion.v = s.motion.q = VectorXd::Zero(rows);
  s.valid.assign(static_cast<std::size_t>(rows), 1);
  s.held_out.assign(static_cast<std::size_t>(rows), 0);
  s.fresh.assign(static_cast<std::size_t>(rows), 0);
  s.fresh.front() = 1;
  for (Index i = 0; i < rows; ++i) {
    s.motion.q[i] = 0.01 - 0.02 * std::abs(s.t_s[i] - 1.0);
    s.motion.v[i] = s.t_s[i] < 1.0 ? 0.02 : -0.02;
  }
  return s;
}

TEST(DriveFriction, TurnsOverItsDisplacementAsDahlSays) {
  const Series s = there_and_back();
  const VectorXd f = diagnose::dry_friction(s, {5e-4});
  for (Index i = 200; i < s.rows(); ++i) {
    const double since = 0.01 - s.motion.q[i];
    EXPECT_NEAR(f[i], 2.0 * std::exp(-since / 5e-4) - 1.0, 1e-6);
  }
}

TEST(DriveFriction, RisesAtLowSpeedOnlyOnceTheBristlesAreBent) {
  Series s = there_and_back();
  for (Index i = 200; i < s.rows(); ++i) s.motion.v[i] = -0.002;
  const VectorXd f = diagnose::dry_friction(s, {5e-4, 0.4, 0.01, diagnose::FallOff::kSteep});
  EXPECT_LT(f[150], 1.01) << "at full speed nothing is added";
  EXPECT_GT(f[200], 0.4) << "right after the reversal it still pulls the other way";
  EXPECT_NEAR(f[s.rows() - 1], -1.0 - 0.4 * std::exp(-0.04), 0.01);
}

TEST(DriveFriction, GrowsWithALoadThatThePlantLacks) {
  Series s = there_and_back();
  s.weight = s.transmitted = VectorXd::Constant(s.rows(), 1.0);
  const VectorXd known = generator::form_of("load_dependent_friction")->columns(s, {}).col(0);
  EXPECT_NEAR(known[150], 1.0, 1e-3);
  const VectorXd found = VectorXd::Constant(s.rows(), 0.5);
  const VectorXd both =
      generator::form_of("load_dependent_friction", {}, {}, found)->columns(s, {}).col(0);
  EXPECT_NEAR(both[150], 1.5, 1e-3);
}

}  // namespace
