// SPDX-License-Identifier: Apache-2.0
//
// Where a mismatch is said to be, and what the page draws of a channel.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "diagnose/explain/circumstances.hpp"
#include "diagnose/explain/parts.hpp"
#include "diagnose/track/filter.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using record::Role;

constexpr double kPeriodS = 0.02;
constexpr Index kRows = 4000;
constexpr double kLengthS = kPeriodS * kRows;
/// Length of a block: the shortest recordings have 24.
constexpr double kBlockS = kLengthS / 24.0;
constexpr double kEffortNoise_n_m = 0.02;

physics::Plant plant_of(double friction_n_m) {
  auto plant = physics::parse_plant(R"(
[robot]
name = "pendulum"
gravity_m_per_s2 = [0.0, -9.8, 0.0]
tool_joints_rad = [0.0, 0.0, 0.0, 0.0]
[[joint]]
name = "one"
kind = "revolute"
motor_inertia_kg_m2 = 1e-4
gearbox_ratio = 10.0
reduction = 50.0
joint_encoder_resolution_rad = 1e-4
  [joint.link]
  mass_kg = 1.0
  com_m = [0.2, 0.0, 0.0]
  inertia_kg_m2 = [0.0, 0.0, 0.01]
  [[joint.effect]]
  id = "compliance"
  stiffness_n_m_per_rad = 300.0
  damping_n_m_s_per_rad = 1.0
  [[joint.effect]]
  id = "coulomb_friction"
  level_n_m = )" + std::to_string(friction_n_m),
                                    "test.toml");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  return std::move(plant).value();
}

physics::ForcedMotion motion() {
  physics::ForcedMotion forced;
  forced.t_s = VectorXd::LinSpaced(kRows, 0.0, kLengthS - kPeriodS);
  forced.fresh.assign(static_cast<std::size_t>(kRows), 0);
  forced.fresh.front() = 1;
  const VectorXd q =
      0.4 * (0.7 * forced.t_s.array()).sin() + 0.2 * (1.9 * forced.t_s.array()).sin();
  forced.motors = {{q, first_difference(q, kPeriodS), second_difference(q, kPeriodS), 0.0}};
  return forced;
}

/// What is recorded beside what the robot's plant says: at a row's time, position and velocity.
using Added = std::function<double(double t_s, double q_rad, double v_rad_per_s)>;

record::Recording recording_of(const physics::Plant& robot, const Added& effort_n_m = {},
                               const Added& position_rad = {}) {
  const physics::ForcedMotion forced = motion();
  const auto predicted = physics::predict(robot, forced);
  EXPECT_TRUE(predicted.ok());
  record::Recording r;
  r.channels = {{"motor", "rad", Role::kMotorPosition, "one"},
                {"torque", "N_m", Role::kDriveTorque, "one"},
                {"truth", "rad", Role::kJointTruth, "one"}};
  r.samples.resize(kRows, 3);
  std::mt19937 random(1);
  std::normal_distribution<double> noise;
  const physics::Motion& motor = forced.motors[0];
  for (Index i = 0; i < kRows; ++i) {
    const auto of = [&](const Added& added) {
      return added ? added(forced.t_s[i], motor.q[i], motor.v[i]) : 0.0;
    };
    r.t_ns.push_back(std::llround(1e9 * forced.t_s[i]));
    r.samples(i, 0) = 50.0 * motor.q[i];
    r.samples(i, 1) =
        (predicted->effort[0][i] + kEffortNoise_n_m * noise(random) + of(effort_n_m)) / 5.0;
    r.samples(i, 2) = predicted->position[0][i] + 1e-4 * noise(random) + of(position_rad);
  }
  r.source = "test";
  return r;
}

Likelihood likelihood_of(const record::Recording& recording, const physics::Plant& plant,
                         const physics::Plant& robot, double from_s = 0.0) {
  std::vector<Track> tracks;
  tracks.push_back(*make_track(recording, plant, from_s, 1e9));
  Likelihood likelihood(plant, std::move(tracks));
  State known = likelihood.base();
  known.plant = robot;
  likelihood.estimate_noise(known);
  return likelihood;
}

NamedEffect effect_in(const std::string& stage, const std::string& id) {
  NamedEffect effect;
  effect.id = id;
  effect.joint = "one";
  effect.stage = stage;
  effect.p_value = 1e-4;
  return effect;
}

/// Of a recording that has more than the plant, which no plant can hold.
Mismatch mismatch_of(const std::string& stage, const Added& effort_n_m, const Added& position_rad,
                     double from_s = 0.0) {
  const physics::Plant plant = plant_of(0.5);
  const Likelihood rows =
      likelihood_of(recording_of(plant, effort_n_m, position_rad), plant, plant, from_s);
  Report report;
  Unexplained unexplained;
  unexplained.joint = "one";
  unexplained.stage = stage;
  report.unexplained = {unexplained};
  add_mismatch(view_of(plant, plant, rows, false), report);
  EXPECT_EQ(report.mismatch.size(), 1U);
  return report.mismatch.empty() ? Mismatch{} : report.mismatch.front();
}

TEST(DiagnosePlots, AStepBeginsAtItsMoment) {
  constexpr double kStep_rad = 2e-3, kStep_s = 50.0;
  const Added step = [](double t_s, double, double) { return t_s < kStep_s ? 0.0 : kStep_rad; };
  const Mismatch found = mismatch_of("transmission", {}, step);
  ASSERT_EQ(found.interval_s.size(), 1U);
  EXPECT_NEAR(found.interval_s[0].first, kStep_s, kBlockS);
  EXPECT_NEAR(found.interval_s[0].second, kLengthS, kBlockS);
  EXPECT_TRUE(std::isnan(found.p_value));
  EXPECT_EQ(found.unit, "rad");
  // Of rows that begin later in the recording too.
  const Mismatch late = mismatch_of("transmission", {}, step, 30.0);
  ASSERT_EQ(late.interval_s.size(), 1U);
  EXPECT_NEAR(late.interval_s[0].first, kStep_s, kBlockS);
}

TEST(DiagnosePlots, ABumpIsWhereItIs) {
  constexpr double kCentre_rad = 0.2, kHalfWidth_rad = 0.1;
  const Mismatch found = mismatch_of("transmission", {}, [](double, double q_rad, double) {
    const double x = (q_rad - kCentre_rad) / kHalfWidth_rad;
    return std::abs(x) < 1.0 ? 1e-3 * (1.0 + std::cos(std::numbers::pi * x)) : 0.0;
  });
  ASSERT_EQ(found.position.size(), 1U);
  EXPECT_GT(found.position[0].first, kCentre_rad - kHalfWidth_rad);
  EXPECT_LT(found.position[0].first, kCentre_rad - 0.3 * kHalfWidth_rad);
  EXPECT_GT(found.position[0].second, kCentre_rad + 0.3 * kHalfWidth_rad);
  EXPECT_LT(found.position[0].second, kCentre_rad + kHalfWidth_rad);
}

TEST(DiagnosePlots, OneDirectionOrSpeedIsSaid) {
  const Mismatch back =
      mismatch_of("drive", [](double, double, double v) { return v < 0.0 ? 0.3 : 0.0; }, {});
  EXPECT_EQ(back.regime, std::vector<std::string>{"direction: negative"});
  const Mismatch fast = mismatch_of(
      "drive", [](double, double, double v) { return std::abs(v) > 0.4 ? 0.3 : 0.0; }, {});
  EXPECT_EQ(fast.regime, std::vector<std::string>{"speed: high third"});
}

/// A robot with more friction than its plant says.
class DiagnosePlotsOfFriction : public testing::Test {
 protected:
  const physics::Plant given = plant_of(0.5), robot = plant_of(0.8);
  const record::Recording recording = recording_of(robot);
  const Likelihood rows = likelihood_of(recording, given, robot);
  const View view = view_of(given, robot, rows, false);
  Report report;

  void SetUp() override { report.effects = {effect_in("drive", "coulomb_friction")}; }
};

TEST_F(DiagnosePlotsOfFriction, IsNearlyEverywhere) {
  add_mismatch(view, report);
  ASSERT_EQ(report.mismatch.size(), 1U);
  const Mismatch& found = report.mismatch[0];
  EXPECT_EQ(found.regime, std::vector<std::string>{"everywhere"});
  ASSERT_EQ(found.position.size(), 1U);
  const VectorXd q = motion().motors[0].q;
  EXPECT_GT(found.position[0].second - found.position[0].first,
            0.85 * (q.maxCoeff() - q.minCoeff()));
  ASSERT_EQ(found.interval_s.size(), 1U);
  EXPECT_GT(found.interval_s[0].second - found.interval_s[0].first, 0.85 * kLengthS);
  EXPECT_NEAR(found.excess_rmse, 0.3, 0.03);
  EXPECT_LT(found.floor, kEffortNoise_n_m);
  EXPECT_DOUBLE_EQ(found.p_value, 1e-4);
}

TEST_F(DiagnosePlotsOfFriction, GrowsToTheFloorAndKeepsItsSize) {
  add_plots(view, {given, {{"coulomb_friction", "one", "", robot, given}}}, 3, report);
  ASSERT_EQ(report.plots.size(), 2U);
  const ChannelPlot& plot = report.plots[0];
  EXPECT_EQ(plot.stage, "drive");
  ASSERT_EQ(plot.waterfall.size(), 4U);
  EXPECT_EQ(plot.waterfall[2].step, "coulomb_friction");
  EXPECT_LT(plot.waterfall[2].rmse, 0.2 * plot.waterfall[1].rmse);
  EXPECT_EQ(plot.waterfall[3].step, "floor");
  EXPECT_EQ(report.plots[1].waterfall.size(), 3U) << "friction of the drive moves no joint";
  ASSERT_FALSE(plot.scales.empty());
  for (const RegimeScale& scale : plot.scales)
    EXPECT_NEAR(scale.scale, 1.0, std::max(0.02, 4.0 * scale.deviation)) << scale.circumstance;
  EXPECT_LT(report.effects[0].invariance_spread, 0.1);
}

TEST_F(DiagnosePlotsOfFriction, DrawsWhatWasRecorded) {
  add_plots(view, {given, {}}, 3, report);
  ASSERT_EQ(report.plots.size(), 2U);
  for (const ChannelPlot& plot : report.plots) {
    SCOPED_TRACE(plot.stage);
    EXPECT_GT(plot.t_s.size(), 100U);
    EXPECT_LE(plot.t_s.size(), 400U);
    for (const auto* values :
         {&plot.position, &plot.before, &plot.after, &plot.speed, &plot.load, &plot.hold_s})
      EXPECT_EQ(values->size(), plot.t_s.size());
    EXPECT_GT(std::count_if(plot.where.before.begin(), plot.where.before.end(),
                            [](double v) { return std::isfinite(v); }),
              20);
    ASSERT_EQ(plot.traces.size(), 1U);
    const Trace& trace = plot.traces[0];
    EXPECT_EQ(trace.recording, 3U);
    EXPECT_TRUE(trace.fitted);
    EXPECT_GT(trace.t_s.size(), 200U);
    const std::size_t channel = plot.stage == "drive" ? 0 : 1;
    double off = 0.0, shown = 0.0;
    for (std::size_t k = 0; k < trace.t_s.size(); ++k) {
      if (std::isnan(trace.t_s[k])) continue;
      const auto row = std::lround(trace.t_s[k] / kPeriodS);
      const double recorded =
          channel == 0 ? 5.0 * recording.samples(row, 1) : recording.samples(row, 2);
      off += std::abs(trace.measured[k] + (channel == 0 ? 0.0 : trace.motion[k]) - recorded);
      shown += 1.0;
      EXPECT_NEAR(trace.measured[k] - trace.nominal[k], view.before[channel][0][row], 1e-12);
      EXPECT_NEAR(trace.measured[k] - trace.refitted[k], view.after[channel][0][row], 1e-12);
    }
    EXPECT_LT(off / shown, channel == 0 ? 0.15 : 0.005) << "seen through the filter";
  }
}

TEST(DiagnosePlots, AProxyHasAnotherSizeInOneHalf) {
  constexpr Index kSamples = 600;
  ChannelRows at;
  at.t_s = VectorXd::LinSpaced(kSamples, 0.0, 60.0);
  at.position_ji = at.t_s.array().sin();
  at.speed_ji_per_s = (0.9 * at.t_s.array()).cos();
  for (Index i = 0; i < kSamples; ++i) at.blocks.push_back(static_cast<int>(i / 25));
  const VectorXd contribution = (2.3 * at.t_s.array()).sin();
  VectorXd left = VectorXd::Zero(kSamples);
  EXPECT_LT(spread_of(scales_of("creep", contribution, left, at)), 1e-9);
  for (Index i = 0; i < kSamples; ++i)
    if (at.speed_ji_per_s[i] < 0.0) left[i] = -0.6 * contribution[i];
  const std::vector<RegimeScale> scales = scales_of("creep", contribution, left, at);
  ASSERT_GE(scales.size(), 2U);
  EXPECT_EQ(scales[0].circumstance, "direction: negative");
  EXPECT_NEAR(scales[0].scale, 0.4, 1e-6);
  EXPECT_NEAR(scales[1].scale, 1.0, 1e-6);
  EXPECT_NEAR(spread_of(scales), 0.6, 1e-6);
}

}  // namespace
}  // namespace ravencal::diagnose
