// SPDX-License-Identifier: Apache-2.0
//
// The command's channel of an arm whose motors wind each other's cables.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
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
      const bool limited = std::any_of(findings.not_found.begin(), findings.not_found.end(),
                                       [](const diagnose::NotFound& n) {
                                         return n.id == "controller_gain" && n.detection_limit &&
                                                std::abs(*n.detection_limit - 0.02) < 2e-3;
                                       });
      EXPECT_EQ(limited, !named) << plant_gain;
    }
  }
}

/// The first drive's command; `change` adds to it, in N m at the joint.
template <typename Change>
diagnose::Series command_of(const physics::Plant& plant, Change&& change) {
  const auto set = diagnose::build_series({servoed_motion()}, {}, plant, {});
  for (const diagnose::Series& s : set.value().series) {
    if (s.stage != diagnose::Stage::kCommand || s.joint != "one") continue;
    diagnose::Series changed = s;
    for (Index i = 0; i < s.rows(); ++i) changed.y[i] += change(s, i);
    return changed;
  }
  return {};
}

diagnose::Series with_noise(diagnose::Series s, double noise_n_m, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal(0.0, noise_n_m);
  for (double& y : s.y) y += normal(engine);
  return s;
}

/// Wandering: what it adds to differences between neighbours repeats nothing.
diagnose::Series with_walk(diagnose::Series s, double step_n_m, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal(0.0, step_n_m);
  double walk = 0.0;
  for (double& y : s.y) y += walk += normal(engine);
  return s;
}

diagnose::ChannelOptions with_alpha(double alpha) {
  diagnose::ChannelOptions options;
  options.gates.alpha = alpha;
  return options;
}

bool names_gain(const diagnose::ChannelFindings& findings) {
  return std::any_of(findings.effects.begin(), findings.effects.end(),
                     [](const diagnose::NamedEffect& e) { return e.id == "controller_gain"; });
}

std::optional<diagnose::NotFound> unnamed_gain(const diagnose::ChannelFindings& findings) {
  for (const diagnose::NotFound& n : findings.not_found) {
    if (n.id == "controller_gain") return n;
  }
  return std::nullopt;
}

/// The drive's own gain is `ratio` times the plant's.
diagnose::Series gain_off_by(const physics::Plant& plant, double ratio) {
  constexpr double kPerError = kGain * kReduction * kReduction;
  return command_of(plant, [&](const diagnose::Series& s, Index i) {
    return (ratio - 1.0) * kPerError * s.position_error[i];
  });
}

TEST(Command, NamesAGainAtItsTolerancesEndAsOftenAsItsShareOfTheErrorRateSays) {
  const physics::Plant plant = servoed();
  // Noise is small enough for every gate but that of chance.
  const diagnose::Series at_its_end = gain_off_by(plant, 1.02);
  int often = 0, seldom = 0;
  constexpr int kDraws = 300;
  for (std::uint64_t seed = 1; seed <= kDraws; ++seed) {
    const diagnose::Series noisy = with_walk(at_its_end, 1e-4, seed);
    diagnose::ChannelOptions options = with_alpha(0.4);
    options.details = false;
    often += names_gain(diagnose::analyse_command(noisy, plant, options)) ? 1 : 0;
    options.gates.alpha = 0.004;
    seldom += names_gain(diagnose::analyse_command(noisy, plant, options)) ? 1 : 0;
  }
  // Two questions share the rate, and beyond its end is one side of two: 30 and 0.3 are expected.
  EXPECT_GT(often, 12);
  EXPECT_LT(often, 54);
  EXPECT_LE(seldom, 4);
}

TEST(Command, LimitOfTheGainGrowsWithNoise) {
  const physics::Plant plant = servoed();
  const diagnose::Series silent = command_of(plant, [](const auto&, Index) { return 0.0; });
  const auto limit = [&](double noise_n_m) {
    const auto entry =
        unnamed_gain(diagnose::analyse_command(with_noise(silent, noise_n_m, 7), plant, {}));
    EXPECT_TRUE(entry && entry->detection_limit) << entry->not_testable_because;
    return entry->detection_limit.value_or(0.0);
  };
  EXPECT_NEAR(limit(1e-6), 0.02, 1e-3);
  EXPECT_GT(limit(0.1), 0.03);
  EXPECT_GT(limit(0.5), 3.0 * limit(0.1));
  EXPECT_GT(limit(1.0), 1.5 * limit(0.5));
}

TEST(Command, NamesAGainBeyondItsLimitNineTimesInTen) {
  const physics::Plant plant = servoed();
  const double noise_n_m = 0.5;
  const diagnose::Series silent = command_of(plant, [](const auto&, Index) { return 0.0; });
  const auto entry =
      unnamed_gain(diagnose::analyse_command(with_noise(silent, noise_n_m, 7), plant, {}));
  ASSERT_TRUE(entry && entry->detection_limit);
  const double limit = *entry->detection_limit;
  const diagnose::Series at = gain_off_by(plant, 1.0 + limit);
  const diagnose::Series half = gain_off_by(plant, 1.0 + 0.5 * limit);
  int named = 0, named_at_half = 0;
  constexpr int kDraws = 50;
  for (std::uint64_t seed = 100; seed < 100 + kDraws; ++seed) {
    named += names_gain(diagnose::analyse_command(with_noise(at, noise_n_m, seed), plant, {}));
    named_at_half +=
        names_gain(diagnose::analyse_command(with_noise(half, noise_n_m, seed), plant, {}));
  }
  EXPECT_GE(named, 38) << limit;
  EXPECT_LE(named_at_half, 5) << limit;
}

TEST(Command, HasNoLimitWhereAnotherLawMadeIt) {
  const physics::Plant plant = servoed();
  const diagnose::Series other = command_of(plant, [](const diagnose::Series& s, Index i) {
    return 12.0 * std::sin(2.9 * s.t_s[i]) + 5.0 * std::sin(0.37 * s.t_s[i]);
  });
  const auto findings = diagnose::analyse_command(with_noise(other, 0.01, 3), plant, {});
  EXPECT_FALSE(names_gain(findings));
  const auto entry = unnamed_gain(findings);
  ASSERT_TRUE(entry);
  EXPECT_FALSE(entry->detection_limit);
  EXPECT_NE(entry->not_testable_because.find(" % of the recorded command"), std::string::npos)
      << entry->not_testable_because;
}

/// A controller at 1 kHz, recorded at 50 Hz without the rate that it saw.
record::Recording recorded_slowly(double ratio) {
  using record::Role;
  record::Recording r;
  r.source = "generated";
  r.channels = {{"one.desired", "rad", Role::kDesiredPosition, "one"},
                {"one.estimate", "rad", Role::kJointEstimate, "one"},
                {"one.torque", "N_m", Role::kDriveTorque, "one"}};
  constexpr int kRows = 3000, kCycles = 20;
  constexpr double kCycle_s = 1e-3, kRate = 0.006, kInertia = 0.23, kBrief_s = 0.05;
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal(0.0, 0.3 * std::sqrt(2.0 * kCycle_s / kBrief_s));
  double q = 0.0, v = 0.0, last = 0.0, push = 0.0, t_s = 0.0;
  r.samples.resize(kRows, 3);
  for (Index row = 0; row < kRows; ++row) {
    for (int cycle = 0; cycle < kCycles; ++cycle, t_s += kCycle_s) {
      const double desired = 0.4 * std::sin(0.7 * t_s) + 0.2 * std::sin(2.1 * t_s);
      const double seen = 1e-6 * std::floor(1e6 * q);
      const double torque =
          kReduction * (ratio * kGain * (desired - seen) - kRate * (seen - last) / kCycle_s);
      last = seen;
      if (cycle == 0) r.samples.row(row) << desired, seen, torque;
      push += normal(engine) - push * kCycle_s / kBrief_s;
      v += (kReduction * torque - 1.5 * std::tanh(v / 0.01) - 2.0 * v + push) / kInertia * kCycle_s;
      q += v * kCycle_s;
    }
    r.t_ns.push_back(static_cast<std::int64_t>(row) * kCycles * 1'000'000);
  }
  return r;
}

TEST(Command, KnowsAGainOfAControllerThatIsFasterThanTheRecording) {
  const physics::Plant plant = servoed();
  for (const double ratio : {1.0, 1.46}) {
    const auto set = diagnose::build_series({recorded_slowly(ratio)}, {}, plant, {});
    ASSERT_TRUE(set.ok()) << set.error().message;
    for (const diagnose::Series& s : set->series) {
      if (s.stage != diagnose::Stage::kCommand) continue;
      const auto findings = diagnose::analyse_command(s, plant, {});
      EXPECT_EQ(names_gain(findings), ratio > 1.0);
      if (!names_gain(findings)) continue;
      const diagnose::NamedParameter& found = findings.effects.front().parameters.front();
      EXPECT_LE(found.ci95.first, ratio);
      EXPECT_GE(found.ci95.second, ratio);
    }
  }
}

TEST(Command, HasNoLimitWhereTooFewRowsShowIt) {
  const physics::Plant plant = servoed();
  diagnose::Series s = command_of(plant, [](const auto&, Index) { return 0.0; });
  std::fill(s.valid.begin() + 150, s.valid.end(), 0);
  const auto entry = unnamed_gain(diagnose::analyse_command(s, plant, {}));
  ASSERT_TRUE(entry);
  EXPECT_FALSE(entry->detection_limit);
  EXPECT_NE(entry->not_testable_because.find("200 rows"), std::string::npos);
}

TEST(Command, SaysSoWherePulsesAreTooFewToTellFromChance) {
  const physics::Plant plant = servoed();
  const diagnose::Series s = command_of(plant, [](const diagnose::Series&, Index i) {
    return i % 1500 > 1000 && i % 1500 < 1200 ? 8.0 : 0.0;
  });
  const auto findings = diagnose::analyse_command(with_noise(s, 0.01, 5), plant, {});
  EXPECT_TRUE(findings.effects.empty());
  const auto it = std::find_if(findings.not_found.begin(), findings.not_found.end(),
                               [](const auto& n) { return n.id == "input_disturbance"; });
  ASSERT_NE(it, findings.not_found.end());
  EXPECT_FALSE(it->detection_limit);
  EXPECT_NE(it->not_testable_because.find("2 pulses"), std::string::npos)
      << it->not_testable_because;
}

TEST(Command, WithoutDetailsSaysOnlyWhatItNames) {
  const physics::Plant plant = servoed();
  diagnose::ChannelOptions options;
  options.details = false;
  const diagnose::Series silent = command_of(plant, [](const auto&, Index) { return 0.0; });
  EXPECT_TRUE(diagnose::analyse_command(silent, plant, options).not_found.empty());
  EXPECT_TRUE(names_gain(diagnose::analyse_command(gain_off_by(plant, 1.3), plant, options)));
}

TEST(Command, NamesAGainBesidePulses) {
  const physics::Plant plant = servoed();
  const diagnose::Series s = command_of(plant, [](const diagnose::Series& own, Index i) {
    return 0.3 * kGain * kReduction * kReduction * own.position_error[i] +
           (i % 300 < 60 ? 8.0 : 0.0);
  });
  const auto findings = diagnose::analyse_command(with_noise(s, 0.01, 5), plant, {});
  EXPECT_EQ(findings.effects.size(), 2U);
  EXPECT_TRUE(names_gain(findings));
}

}  // namespace
