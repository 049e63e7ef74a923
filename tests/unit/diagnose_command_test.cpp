// SPDX-License-Identifier: Apache-2.0
//
// The command's channel of an arm whose motors wind each other's cables.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "diagnose/channel/channel.hpp"
#include "diagnose/series/series.hpp"
#include "diagnose_two_joints.hpp"
#include "record/recording.hpp"

namespace {

using namespace ravencal;
using Eigen::Index;

constexpr double kReduction = generator::kTwoJointReduction, kGain = 0.3;
constexpr double kCoupling = generator::kTwoJointCoupling;

physics::Plant servoed(const std::string& gain = "0.3") {
  return generator::two_joints("  [joint.controller]\n  kp_n_m_per_rad = " + gain +
                               "\n  kd_n_m_s_per_rad = 0.01\n"
                               "  dac_limit_counts = 2500\n");
}

/// Both joints follow a sine with errors of their own; the controllers act on motor angles. The
/// first drive's command has pulses and is cut to whole steps.
record::Recording servoed_motion(double pulse_n_m = 0.0, double step_n_m = 0.0) {
  using record::Role;
  record::Recording r;
  r.source = "generated";
  for (const std::string name : {"one", "two"}) {
    r.channels.push_back({name + ".desired", "rad", Role::kDesiredPosition, name});
    r.channels.push_back({name + ".estimate", "rad", Role::kJointEstimate, name});
    r.channels.push_back({name + ".torque", "N_m", Role::kDriveTorque, name});
  }
  constexpr Index kRows = 4000;
  r.samples.resize(kRows, 6);
  for (Index i = 0; i < kRows; ++i) {
    const double t_s = 0.01 * static_cast<double>(i);
    const double one = 0.4 * std::sin(0.7 * t_s), two = 0.3 * std::sin(0.5 * t_s);
    const double lag_one = 2e-3 * std::sin(1.3 * t_s), lag_two = 1e-3 * std::cos(0.9 * t_s);
    double torque_one = kGain * kReduction * lag_one;
    const double pulsed = torque_one + (i % 600 < 120 ? pulse_n_m : 0.0);
    if (step_n_m > 0.0) torque_one = step_n_m * std::trunc(pulsed / step_n_m);
    const double torque_two = kGain * kReduction * (lag_two - kCoupling * lag_one);
    r.t_ns.push_back(static_cast<std::int64_t>(i) * 10'000'000);
    r.samples.row(i) << one, one - lag_one, torque_one, two, two - lag_two, torque_two;
  }
  return r;
}

TEST(Command, IsDrivenByTheErrorOfItsOwnMotor) {
  const physics::Plant plant = servoed();
  const auto set = diagnose::build_series({servoed_motion()}, {}, plant, {});
  ASSERT_TRUE(set.ok()) << set.error().message;
  int seen = 0;
  for (const diagnose::Series& s : set->series) {
    if (s.stage != diagnose::Stage::kCommand) continue;
    ++seen;
    const double per_error = kGain * kReduction * kReduction;
    EXPECT_LT((s.y - per_error * s.position_error).norm(), 1e-6 * s.y.norm()) << s.joint;
  }
  EXPECT_EQ(seen, 2);
}

TEST(Command, KnowsThePulsesToItsStepAtBest) {
  const physics::Plant plant = servoed();
  constexpr double kPulse = 0.0137, kStep = 0.001;
  const auto set = diagnose::build_series({servoed_motion(kPulse, kStep)}, {}, plant, {});
  ASSERT_TRUE(set.ok()) << set.error().message;
  for (const diagnose::Series& s : set->series) {
    if (s.stage != diagnose::Stage::kCommand || s.joint != "one") continue;
    const auto findings = diagnose::analyse_command(s, plant, {});
    ASSERT_EQ(findings.effects.size(), 1U);
    EXPECT_EQ(findings.effects.front().id, "input_disturbance");
    const diagnose::NamedParameter& size = findings.effects.front().parameters.front();
    const double truth = kPulse * kReduction;
    EXPECT_LE(size.ci95.first, truth);
    EXPECT_GE(size.ci95.second, truth);
    EXPECT_LT(size.ci95.second - size.ci95.first, 0.2 * truth);
    EXPECT_GT(size.ci95.second - size.ci95.first, kStep * kReduction);
  }
}

TEST(Command, KnowsItsGainToTheStepThatCutsAllCommandsAlike) {
  const physics::Plant plant = servoed("0.15");
  const auto set = diagnose::build_series({servoed_motion(0.0, 0.002)}, {}, plant, {});
  ASSERT_TRUE(set.ok()) << set.error().message;
  for (const diagnose::Series& s : set->series) {
    if (s.stage != diagnose::Stage::kCommand || s.joint != "one") continue;
    const auto findings = diagnose::analyse_command(s, plant, {});
    ASSERT_EQ(findings.effects.size(), 1U);
    EXPECT_EQ(findings.effects.front().id, "controller_gain");
    const diagnose::NamedParameter& ratio = findings.effects.front().parameters.front();
    EXPECT_LE(ratio.ci95.first, 2.0);
    EXPECT_GE(ratio.ci95.second, 2.0);
    EXPECT_LT(ratio.ci95.second - ratio.ci95.first, 0.2);
  }
}

TEST(Command, GainIsANumberInSoftwareAndKnownToTwoPercent) {
  for (const auto& [plant_gain, named] : {std::pair{"0.32", true}, {"0.303", false}}) {
    const physics::Plant plant = servoed(plant_gain);
    const auto set = diagnose::build_series({servoed_motion()}, {}, plant, {});
    ASSERT_TRUE(set.ok()) << set.error().message;
    for (const diagnose::Series& s : set->series) {
      if (s.stage != diagnose::Stage::kCommand || s.joint != "one") continue;
      const auto findings = diagnose::analyse_command(s, plant, {});
      EXPECT_EQ(!findings.effects.empty(), named) << plant_gain;
      const bool limited = std::any_of(
          findings.not_found.begin(), findings.not_found.end(), [](const diagnose::NotFound& n) {
            return n.id == "controller_gain" && n.detection_limit == 0.02;
          });
      EXPECT_EQ(limited, !named) << plant_gain;
    }
  }
}

}  // namespace
