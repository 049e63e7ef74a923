// SPDX-License-Identifier: Apache-2.0
#include "learn/train.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "learn/dataset.hpp"
#include "learn/evaluate.hpp"
#include "unit/learn/sample_arm.hpp"

namespace ravencal::learn {
namespace {

using record::Recording;
constexpr double kLost = std::numeric_limits<double>::quiet_NaN();

TrainOptions linear() {
  TrainOptions options;
  options.hidden.clear();
  return options;
}

core::Result<TrainResult> train(const Recording& recording, const TrainOptions& options,
                                const Recording* validation = nullptr) {
  const Recording* const training[] = {&recording};
  const Recording* const held_out[] = {validation};
  const auto some = std::span(held_out).first(validation != nullptr ? 1 : 0);
  return train_model(training, some, options, [](const EpochReport&) { return true; });
}

core::Result<Evaluation> evaluate_on(const model::CalibrationModel& model,
                                     const Recording& recording) {
  const Recording* const recordings[] = {&recording};
  return evaluate(model, recordings);
}

TEST(Train, FindsALinearErrorExactlyWithoutHiddenLayers) {
  const auto result = train(sample_arm(500, 1), linear());
  ASSERT_TRUE(result.ok()) << result.error().message;
  const auto evaluation = evaluate_on(result->model, sample_arm(300, 2));
  ASSERT_TRUE(evaluation.ok()) << evaluation.error().message;
  // Weights and inputs are single precision: 6e-8 of values of about 1.
  EXPECT_LT(evaluation->joints[0].calibrated.peak, 1e-6);
  EXPECT_LT(evaluation->joints[1].calibrated.peak, 1e-7);
  EXPECT_GT(evaluation->joints[0].bias_removed.rmse, 0.01);
}

TEST(Train, RefusesTooFewRows) {
  for (const int rows : {1, 2, 10, 49}) {
    const auto result = train(sample_arm(rows, 1), linear());
    ASSERT_FALSE(result.ok()) << rows;
    EXPECT_EQ(result.error().code, core::ErrorCode::kData);
    EXPECT_NE(result.error().message.find("too few"), std::string::npos) << result.error().message;
  }
  TrainOptions many_inputs = linear();
  many_inputs.history = 100;
  EXPECT_FALSE(train(sample_arm(60, 1), many_inputs).ok());
  EXPECT_TRUE(train(sample_arm(60, 1), linear()).ok());
}

/// The same constant at every row.
Recording with_constant_error(Recording arm) {
  arm.samples.col(1) = arm.samples.col(0).array() + 0.2;
  arm.samples.col(3) = arm.samples.col(2).array() - 0.0118;
  return arm;
}

TEST(Train, LearnsAConstantErrorAsAConstant) {
  TrainOptions network;
  network.hidden = {8};
  network.trainer.epochs = 2;
  for (const TrainOptions& options : {linear(), network}) {
    const auto result = train(with_constant_error(sample_arm(300, 1)), options);
    ASSERT_TRUE(result.ok()) << result.error().message;
    const auto evaluation =
        evaluate_on(result->model, with_constant_error(sample_arm(300, 2, 1.0)));
    ASSERT_TRUE(evaluation.ok());
    for (const JointEvaluation& joint : evaluation->joints)
      EXPECT_LT(joint.calibrated.peak, 1e-7) << joint.joint;
    EXPECT_TRUE(warnings_of(*evaluation).empty());
  }
}

// A network without time to learn is worse than no network: its outputs are random.
TEST(Train, IsNeverWorseThanTheMeanOfTheError) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    TrainOptions hasty;
    hasty.hidden = {64, 64};
    hasty.trainer.epochs = 1;
    hasty.trainer.seed = seed;
    hasty.trainer.adam.learning_rate = 0.5;
    const Recording arm = sample_arm(200, seed);
    const auto result = train(arm, hasty);
    if (!result.ok()) continue;  // diverged, which is said
    const auto evaluation = evaluate_on(result->model, arm);
    ASSERT_TRUE(evaluation.ok());
    for (const JointEvaluation& joint : evaluation->joints) {
      EXPECT_LE(joint.calibrated.rmse, joint.bias_removed.rmse * (1.0 + 1e-6)) << joint.joint;
      EXPECT_LE(joint.calibrated.rmse, joint.raw.rmse) << joint.joint;
    }
  }
}

TEST(Evaluate, WarnsWhereCalibratedIsWorseThanRaw) {
  const auto result = train(sample_arm(300, 1), linear());
  ASSERT_TRUE(result.ok());
  Recording right = sample_arm(300, 2);
  right.samples.col(1) = right.samples.col(0);  // the elbow has no error there
  const auto evaluation = evaluate_on(result->model, right);
  ASSERT_TRUE(evaluation.ok());
  const std::vector<std::string> warnings = warnings_of(*evaluation);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("joint elbow: calibrated is worse than raw"), std::string::npos);
}

TEST(Train, DoesNotBlowUpWhenFeaturesRepeatEachOther) {
  Recording arm = sample_arm(400, 1);
  arm.channels.push_back({"elbow.torque_again", "N_m", record::Role::kFeature, ""});
  arm.samples.conservativeResize(Eigen::NoChange, 7);
  arm.samples.col(6) = 2.0 * arm.samples.col(4);
  const auto result = train(arm, linear());
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_LT(result->model.layers[0].weights.cwiseAbs().maxCoeff(), 2.0F);
}

TEST(Train, ShrinksLinearWeightsUnderRidge) {
  TrainOptions options = linear();
  const float free = train(sample_arm(500, 1), options)->model.layers[0].weights.norm();
  options.ridge = 1.0;
  const float shrunk = train(sample_arm(500, 1), options)->model.layers[0].weights.norm();
  EXPECT_NEAR(shrunk / free, 0.5F, 0.05F);  // scaled, independent inputs: 1 / (1 + ridge)
}

TEST(Train, LearnsACurvedErrorWithAHiddenLayer) {
  TrainOptions options;
  options.hidden = {24};
  options.trainer.epochs = 150;
  options.trainer.batch = 32;
  options.trainer.adam.learning_rate = 5e-3;
  const Recording test = sample_arm(500, 2, 0.05);
  const auto network = train(sample_arm(1500, 1, 0.05), options);
  ASSERT_TRUE(network.ok()) << network.error().message;
  const auto line = train(sample_arm(1500, 1, 0.05), linear());
  const double by_network = evaluate_on(network->model, test)->joints[0].calibrated.rmse;
  const double by_line = evaluate_on(line->model, test)->joints[0].calibrated.rmse;
  EXPECT_LT(by_network, 0.4 * by_line);
}

TEST(Train, LeavesOutAndCountsRowsWithLostValues) {
  Recording arm = sample_arm(200, 1);
  arm.samples(10, 1) = kLost;  // truth
  arm.samples(20, 4) = kLost;  // feature
  arm.samples(21, 4) = kLost;
  const auto result = train(arm, linear());
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(result->rows, 197U);
  EXPECT_EQ(result->rows_without_truth, 1U);
  EXPECT_EQ(result->rows_without_feature, 2U);
  ASSERT_EQ(result->warnings.size(), 1U);
  EXPECT_NE(result->warnings[0].find("3 of 200 rows"), std::string::npos) << result->warnings[0];
}

TEST(Train, LeavesOutRowsWhoseHistoryHasALostValue) {
  Recording arm = sample_arm(200, 1);
  arm.samples(20, 4) = kLost;
  TrainOptions options = linear();
  options.history = 3;
  EXPECT_EQ(train(arm, options)->rows_without_feature, 4U);
}

TEST(Train, KeepsAConstantFeatureWithScaleOneAndWarns) {
  Recording arm = sample_arm(200, 1);
  arm.samples.col(4).setConstant(0.1);
  const auto result = train(arm, linear());
  ASSERT_TRUE(result.ok()) << result.error().message;
  std::size_t index = 0;
  while (result->model.features[index].channel != "elbow.torque") ++index;
  EXPECT_EQ(result->model.input.scale(static_cast<Eigen::Index>(index)), 1.0);
  EXPECT_EQ(result->model.input.mean(static_cast<Eigen::Index>(index)), static_cast<double>(0.1F));
  ASSERT_EQ(result->warnings.size(), 1U);
  EXPECT_NE(result->warnings[0].find("elbow.torque"), std::string::npos);
}

TEST(Train, RefusesRecordingsOfWhichNothingIsLeft) {
  Recording arm = sample_arm(50, 1);
  arm.samples.col(1).setConstant(kLost);
  const auto result = train(arm, linear());
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, core::ErrorCode::kData);
  EXPECT_NE(result.error().message.find("no usable row"), std::string::npos);
}

TEST(Train, RefusesRecordingsWithoutATruth) {
  Recording arm = sample_arm(50, 1);
  arm.channels[1].role = record::Role::kFeature;
  arm.channels[3].role = record::Role::kFeature;
  const auto result = train(arm, linear());
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().message.find("truth"), std::string::npos);
}

TEST(Train, CorrectsOnlyTheJointsAskedFor) {
  TrainOptions options = linear();
  options.joints = {"insertion"};
  Recording arm = sample_arm(100, 1);
  arm.samples.col(1).setConstant(kLost);  // the other joint's truth does not matter
  const auto result = train(arm, options);
  ASSERT_TRUE(result.ok()) << result.error().message;
  ASSERT_EQ(result->model.outputs.size(), 1U);
  EXPECT_EQ(result->model.outputs[0].estimate_channel, "insertion.estimate");
  options.joints = {"wrist"};
  EXPECT_FALSE(train(arm, options).ok());
}

TEST(Train, FitsScalingOnTrainingRowsOnly) {
  Recording validation = sample_arm(100, 2);
  validation.samples *= 100.0;
  TrainOptions options;
  options.hidden = {4};
  options.trainer.epochs = 2;
  const auto with = train(sample_arm(200, 1), options, &validation);
  const auto without = train(sample_arm(200, 1), options);
  ASSERT_TRUE(with.ok() && without.ok());
  EXPECT_EQ(with->model.input.mean, without->model.input.mean);
  EXPECT_EQ(with->model.input_max, without->model.input_max);
  EXPECT_EQ(with->model.output.scale, without->model.output.scale);
}

TEST(Train, TrustsItsTrainingRows) {
  const Recording recording = sample_arm(400, 11);
  const auto result = train(recording, linear());
  ASSERT_TRUE(result.ok()) << result.error().message;
  const model::CalibrationModel& model = result->model;
  ASSERT_TRUE(model.trust.has_value());
  const auto rows = model::feature_matrix(model.features, recording, model.row_period_s);
  ASSERT_TRUE(rows.ok());
  const Eigen::MatrixXd centred = rows->cast<double>().rowwise() - model.input.mean.transpose();
  const Eigen::MatrixXd scaled = centred.array().rowwise() / model.input.scale.transpose().array();
  const Eigen::VectorXf distances = model.trust->distances(scaled.transpose().cast<float>());
  EXPECT_LE(distances.maxCoeff(), model.trust->full_distance);
}

TEST(Train, SaysThatAPlayOperatorNeedsAPosition) {
  TrainOptions options = linear();
  options.features = "elbow.torque";
  options.play = {0.01F};
  const auto result = train(sample_arm(50, 1), options);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, core::ErrorCode::kUsage);
}

TEST(Evaluate, RemovesTheBiasOfTrainingNotOfTheTest) {
  const auto result = train(sample_arm(500, 1), linear());
  Recording test = sample_arm(300, 2);
  test.samples.col(1).array() += 0.05;  // the joint moved on by 0.05 rad since training
  const auto evaluation = evaluate_on(result->model, test);
  ASSERT_TRUE(evaluation.ok());
  EXPECT_NEAR(evaluation->joints[0].bias, 0.10, 0.005);
  EXPECT_GT(evaluation->joints[0].bias_removed.rmse, 0.05);
  EXPECT_NEAR(evaluation->joints[0].calibrated.rmse, 0.05, 1e-6);
}

TEST(Evaluate, NamesTheChannelsThatTheRecordingLacks) {
  const auto result = train(sample_arm(100, 1), linear());
  Recording test = sample_arm(100, 2);
  test.channels[4].name = "renamed";
  const auto evaluation = evaluate_on(result->model, test);
  ASSERT_FALSE(evaluation.ok());
  EXPECT_NE(evaluation.error().message.find("elbow.torque"), std::string::npos);
  EXPECT_NE(evaluation.error().message.find("sample.db"), std::string::npos);
}

TEST(Evaluate, WritesDegreesAndMillimetresAsTheContractSays) {
  const auto result = train(sample_arm(100, 1), linear());
  const auto evaluation = evaluate_on(result->model, sample_arm(80, 2));
  ASSERT_TRUE(evaluation.ok());
  const auto json = nlohmann::json::parse(evaluation_json(*evaluation));
  ASSERT_EQ(json["joints"].size(), 2U);
  EXPECT_EQ(json["joints"][0]["joint"], "elbow");
  EXPECT_EQ(json["joints"][0]["unit"], "deg");
  EXPECT_EQ(json["joints"][0]["samples"], 80);
  EXPECT_EQ(json["joints"][1]["unit"], "mm");
  EXPECT_NEAR(json["joints"][0]["raw"]["rmse"].get<double>(),
              evaluation->joints[0].raw.rmse * 57.29577951308232, 1e-9);
  EXPECT_NEAR(json["joints"][1]["bias_removed"]["peak"].get<double>(),
              evaluation->joints[1].bias_removed.peak * 1000.0, 1e-9);
  EXPECT_TRUE(json["joints"][1]["calibrated"].contains("rmse"));
}

TEST(Evaluate, DoesNotCountRowsWithALostFeatureOrTruth) {
  const auto result = train(sample_arm(100, 1), linear());
  Recording test = sample_arm(80, 2);
  test.samples(3, 4) = kLost;
  test.samples(5, 1) = kLost;
  const auto evaluation = evaluate_on(result->model, test);
  ASSERT_TRUE(evaluation.ok());
  EXPECT_EQ(evaluation->joints[0].truth.size(), 78U);
  EXPECT_EQ(evaluation->joints[1].truth.size(), 79U);
  EXPECT_EQ(evaluation->rows_without_feature, 1U);
}

}  // namespace
}  // namespace ravencal::learn
