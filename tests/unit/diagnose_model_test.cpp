// SPDX-License-Identifier: Apache-2.0
//
// The model of `diagnose --core new`: what it skips changes nothing, its noise is white, and it
// names what the twin's plant was robbed of.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "diagnose/explain/explain.hpp"
#include "diagnose/model/likelihood.hpp"
#include "diagnose/model/noise.hpp"
#include "diagnose/track/filter.hpp"
#include "diagnose/vocabulary/vocabulary.hpp"

namespace ravencal::diagnose {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using record::Role;

constexpr double kPeriodS = 0.02;
constexpr Index kRows = 4000;

/// One pendulum behind a cable.
std::string plant_text(const std::string& effects) {
  return R"(
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
  level_n_m = 0.5
)" + effects;
}

physics::Plant plant_of(const std::string& effects) {
  auto plant = physics::parse_plant(plant_text(effects), "test.toml");
  EXPECT_TRUE(plant.ok()) << (plant.ok() ? "" : plant.error().message);
  return std::move(plant).value();
}

/// The pendulum along three sines, with white noise on effort and encoder.
record::Recording recording_of(const physics::Plant& plant, unsigned seed) {
  physics::ForcedMotion forced;
  forced.t_s = VectorXd::LinSpaced(kRows, 0.0, kPeriodS * static_cast<double>(kRows - 1));
  forced.fresh.assign(static_cast<std::size_t>(kRows), 0);
  forced.fresh.front() = 1;
  const VectorXd q = 0.4 * (0.7 * forced.t_s.array() + 0.1 * seed).sin() +
                     0.2 * (1.9 * forced.t_s.array()).sin() +
                     0.1 * (0.13 * forced.t_s.array()).sin();
  forced.motors = {{q, first_difference(q, kPeriodS), second_difference(q, kPeriodS), 0.0, 0.0}};
  const auto predicted = physics::predict(plant, forced);
  EXPECT_TRUE(predicted.ok());
  record::Recording r;
  r.channels = {{"motor", "rad", Role::kMotorPosition, "one"},
                {"torque", "N_m", Role::kDriveTorque, "one"},
                {"truth", "rad", Role::kJointTruth, "one"}};
  r.samples.resize(kRows, 3);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  for (Index i = 0; i < kRows; ++i) {
    r.t_ns.push_back(std::llround(1e9 * kPeriodS * static_cast<double>(i)));
    r.samples(i, 0) = 50.0 * q[i];
    r.samples(i, 1) = (predicted->effort[0][i] + 0.02 * noise(random)) / 5.0;
    r.samples(i, 2) = predicted->position[0][i] + 1e-4 * noise(random);
  }
  r.source = "test";
  return r;
}

Likelihood likelihood_of(const physics::Plant& plant) {
  std::vector<Track> tracks;
  tracks.push_back(*make_track(recording_of(plant, 1), plant, 0.0, 1e9));
  return {plant, std::move(tracks)};
}

TEST(DiagnoseModel, UpdatesAPredictionAsIfItWereMadeAnew) {
  const physics::Plant plant = plant_of("");
  Likelihood likelihood = likelihood_of(plant);
  const Vocabulary vocabulary = vocabulary_of(plant, likelihood, nullptr);
  const State base = likelihood.base();
  const physics::Predictor& predictor = likelihood.predictor(0);
  std::size_t compared = 0;
  for (const Parameter& parameter : vocabulary.numbers) {
    if (parameter.reaches < Reaches::kPosition) continue;
    SCOPED_TRACE(parameter.effect + "." + parameter.name);
    Parameter moved = parameter;
    moved.x += parameter.step;
    State changed = base;
    moved.apply(changed);
    physics::Prediction updated = predictor.predict(base.plant, base.circumstances[0]);
    predictor.update(changed.plant, changed.circumstances[0], parameter.joint,
                     reach_of(parameter.reaches), updated);
    const physics::Prediction anew = predictor.predict(changed.plant, changed.circumstances[0]);
    EXPECT_EQ(updated.effort[0], anew.effort[0]);
    EXPECT_EQ(updated.position[0], anew.position[0]);
    ++compared;
  }
  EXPECT_GE(compared, 8U);
}

TEST(DiagnoseModel, WhitensSlowNoise) {
  const NoiseModel truth{1.5, 0.4, 0.01};
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const double keep = std::exp(-kPeriodS / truth.time_s);
  VectorXd x(kRows);
  double slow = normal(random);
  for (double& value : x) {
    slow = keep * slow + std::sqrt(1.0 - keep * keep) * normal(random);
    value = truth.deviation * (slow + std::sqrt(truth.white_ratio) * normal(random));
  }
  const NoiseRows rows{std::vector<char>(kRows, 1), std::vector<double>(kRows, 0.0), kPeriodS,
                       std::vector<char>(kRows, 0)};
  const NoiseModel found = estimate_noise({&rows}, {&x}, 0.5);
  VectorXd white(kRows);
  Whitener(rows, found).apply(x, white);
  const double variance = white.squaredNorm() / kRows;
  EXPECT_NEAR(variance, 1.0, 0.4);
  EXPECT_LT(std::abs(white.head(kRows - 1).dot(white.tail(kRows - 1))) / (kRows * variance), 0.1);
}

TEST(DiagnoseModel, NamesWhatThePlantLacksAndNothingElse) {
  const physics::Plant robot = plant_of(R"(
  [[joint.effect]]
  id = "viscous_friction"
  damping_n_m_s_per_rad = 0.6
)");
  const auto report_for = [&](const physics::Plant& given) {
    auto report = explain({recording_of(robot, 1)}, {recording_of(robot, 2)}, given, {});
    EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
    return std::move(report).value();
  };
  const Report lacking = report_for(plant_of(""));
  ASSERT_EQ(lacking.effects.size(), 1U);
  EXPECT_EQ(lacking.effects[0].id, "viscous_friction");
  const NamedParameter* damping = find_parameter(lacking.effects[0], "damping");
  ASSERT_NE(damping, nullptr);
  EXPECT_NEAR(damping->value, 0.6, 0.06);
  EXPECT_LT(lacking.effects[0].held_out_after, 0.5 * lacking.effects[0].held_out_before);
  EXPECT_LT(lacking.effects[0].p_value, 1e-6);
  EXPECT_TRUE(report_for(robot).effects.empty());
}

}  // namespace
}  // namespace ravencal::diagnose
