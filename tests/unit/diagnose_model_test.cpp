// SPDX-License-Identifier: Apache-2.0
//
// The model of `diagnose`: what it skips changes nothing, its noise is white, and it
// names what the twin's plant was robbed of.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "diagnose/diagnose.hpp"
#include "diagnose/model/likelihood.hpp"
#include "diagnose/model/noise.hpp"
#include "diagnose/vocabulary/vocabulary.hpp"
#include "diagnose_pendulum.hpp"

namespace ravencal::diagnose {
namespace {

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
  const NoiseModel found = estimate_noise({&rows}, {&x}, 0.5, 20.0);
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
    auto report = diagnose({recording_of(robot, 1)}, {recording_of(robot, 2)}, given, {});
    EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
    return std::move(report).value();
  };
  const Report lacking = report_for(plant_of(""));
  ASSERT_EQ(lacking.effects.size(), 1U);
  EXPECT_EQ(lacking.effects[0].id, "viscous_friction");
  ASSERT_EQ(lacking.effects[0].parameters.size(), 1U);
  EXPECT_EQ(lacking.effects[0].parameters[0].name, "damping");
  EXPECT_NEAR(lacking.effects[0].parameters[0].value, 0.6, 0.06);
  EXPECT_LT(lacking.effects[0].held_out_after, 0.5 * lacking.effects[0].held_out_before);
  EXPECT_LT(lacking.effects[0].p_value, 1e-6);
  EXPECT_TRUE(report_for(robot).effects.empty());
}

}  // namespace
}  // namespace ravencal::diagnose
