// SPDX-License-Identifier: Apache-2.0
#include "learn/expectation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "learn/distance_rank.hpp"

namespace ravencal::learn {
namespace {

/// Two recordings of 20 s whose error is noise of a growing size, about a mean of their own.
JointEvaluation joint_with_growing_error() {
  JointEvaluation joint;
  joint.joint = "elbow";
  joint.unit = "rad";
  std::mt19937_64 generator(4);
  std::normal_distribution<double> normal;
  for (int recording = 0; recording < 2; ++recording) {
    for (int row = 0; row < 2000; ++row) {
      const double size = 1e-3 * (1.0 + 0.01 * row);
      joint.t_s.push_back(0.01 * row);
      joint.truth.push_back(1.0);
      joint.estimate.push_back(1.1);
      joint.corrected.push_back(1.0 + 0.05 * recording + size * normal(generator));
      joint.distance.push_back(size);
    }
  }
  return joint;
}

TEST(DistanceRank, IsOneWhereTheDistanceTellsTheError) {
  JointEvaluation joint = joint_with_growing_error();
  for (double& corrected : joint.corrected) corrected -= corrected > 1.04 ? 0.05 : 0.0;
  EXPECT_GT(distance_rank(joint), 0.9);
  for (double& distance : joint.distance) distance = -distance;
  EXPECT_LT(distance_rank(joint), -0.9);
  for (double& distance : joint.distance) distance = 2.0;
  EXPECT_TRUE(std::isnan(distance_rank(joint)));
  joint.distance.clear();
  EXPECT_TRUE(std::isnan(distance_rank(joint)));
}

TEST(Evaluation, TakesTheMeanErrorOfEachRecordingOff) {
  JointEvaluation joint = joint_with_growing_error();
  set_figures(joint);
  EXPECT_NEAR(joint.calibrated.rmse, std::hypot(0.05 / std::sqrt(2.0), 0.0122), 0.001);
  EXPECT_NEAR(joint.rmse_about_mean, 0.0122, 0.001);
}

TEST(Expectation, StandsBesideWhatCame) {
  Evaluation evaluation;
  evaluation.joints.push_back(joint_with_growing_error());
  EXPECT_EQ(expectation_table(evaluation, true), "");
  JointEvaluation& joint = evaluation.joints[0];
  joint.expected = model::ExpectedError{{0.03, 0.01, 0.09}, std::nullopt, 0.012};
  set_figures(joint);
  EXPECT_NE(expectation_table(evaluation, true).find("inside"), std::string::npos);
  EXPECT_NE(expectation_table(evaluation, true).find("unknown"), std::string::npos);
  EXPECT_TRUE(
      nlohmann::json::parse(evaluation_json(evaluation))["joints"][0]["expected"]["other_homing"]
          .is_null());
  joint.expected->other_homing = model::ExpectedRmse{0.03, 0.01, 0.02};
  EXPECT_NE(expectation_table(evaluation, true).find("outside"), std::string::npos);
  EXPECT_EQ(expectation_table(evaluation, false).find("outside"), std::string::npos);
  const auto json = nlohmann::json::parse(evaluation_json(evaluation))["joints"][0];
  EXPECT_NEAR(json["expected"]["interval_95"][1].get<double>(), 0.02 * 57.29578, 1e-4);
  EXPECT_NEAR(json["expected"]["same_homing"]["interval_95"][1].get<double>(), 0.09 * 57.29578,
              1e-4);
}

}  // namespace
}  // namespace ravencal::learn
