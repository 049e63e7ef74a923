// SPDX-License-Identifier: Apache-2.0
//
// `train` without a method: what is offered, what is chosen, and that the one network it becomes
// computes what the chosen candidates do.
#include <gtest/gtest.h>

#include <random>

#include "choice/assemble.hpp"
#include "choice/choice_table.hpp"
#include "choice/input_sets.hpp"
#include "choice_sample.hpp"
#include "core/catalogue.hpp"
#include "learn/dataset.hpp"

namespace ravencal::choice {
namespace {

TEST(Choice, OfALinearErrorIsLinearAndReachesTheNoise) {
  const auto choice = choose({elbow(3000, 1, kLinear), elbow(3000, 2, kLinear)});
  ASSERT_TRUE(choice.ok()) << choice.error().message;
  EXPECT_EQ(chosen(choice->joints[0]), "linear, own inputs as they are;");
  ASSERT_EQ(choice->model.layers.size(), 1U);
  EXPECT_LT(rmse_on(choice->model, elbow(2000, 3, kLinear)), 0.0008);  // noise: 0.00058
}

TEST(Choice, OfAnErrorWithMemoryRemembers) {
  const auto choice = choose({elbow(6000, 1, kPlay), elbow(6000, 2, kPlay)});
  ASSERT_TRUE(choice.ok()) << choice.error().message;
  EXPECT_NE(chosen(choice->joints[0]).find("memory"), std::string::npos);
  const Recording test = elbow(4000, 3, kPlay);
  ChoiceOptions without_memory;
  without_memory.features = "elbow.estimate";
  const auto forgetful = choose({elbow(6000, 1, kPlay)}, without_memory);
  ASSERT_TRUE(forgetful.ok());
  EXPECT_LT(rmse_on(choice->model, test), 0.35 * rmse_on(forgetful->model, test));
}

TEST(Choice, OfACurvedErrorHasUnits) {
  const auto choice = choose({elbow(6000, 1, kCurve), elbow(6000, 2, kCurve)});
  ASSERT_TRUE(choice.ok()) << choice.error().message;
  EXPECT_NE(chosen(choice->joints[0]).find("units"), std::string::npos);
  ASSERT_EQ(choice->model.layers.size(), 2U);
  const Recording test = elbow(4000, 3, kCurve);
  ChoiceOptions line;
  line.kinds = Kinds::kLinear;
  const auto linear = choose({elbow(6000, 1, kCurve)}, line);
  ASSERT_TRUE(linear.ok());
  EXPECT_LT(rmse_on(choice->model, test), 0.1 * rmse_on(linear->model, test));
}

TEST(Choice, OfAConstantErrorIsTheConstant) {
  Recording arm = elbow(3000, 1, kLinear);
  arm.samples.col(1) = arm.samples.col(0).array() + 0.03;
  const auto choice = choose({arm});
  ASSERT_TRUE(choice.ok()) << choice.error().message;
  EXPECT_EQ(chosen(choice->joints[0]), "bias removed;");
  EXPECT_LT(rmse_on(choice->model, arm), 1e-6);
}

TEST(Choice, OfFewRowsIsRefused) {
  ASSERT_TRUE(choose({elbow(static_cast<int>(learn::kFewestRows), 1, kLinear)}).ok());
  const auto refused = choose({elbow(static_cast<int>(learn::kFewestRows) - 1, 1, kLinear)});
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("joint elbow: 49 usable row(s) are too few"),
            std::string::npos)
      << refused.error().message;
}

TEST(Choice, IsTheSameForTheSameSeed) {
  ChoiceOptions options;
  options.kinds = Kinds::kUnits;
  const std::vector<Recording> training = {elbow(3000, 1, kCurve)};
  const auto first = choose(training, options);
  const auto second = choose(training, options);
  options.seed = 4;
  const auto other = choose(training, options);
  ASSERT_TRUE(first.ok() && second.ok() && other.ok());
  EXPECT_EQ(first->model.layers[0].weights, second->model.layers[0].weights);
  EXPECT_EQ(first->model.layers[1].weights, second->model.layers[1].weights);
  EXPECT_NE(first->model.layers[0].weights, other->model.layers[0].weights);
}

TEST(Choice, TakesJointsWhoseTruthsAreKnownInDifferentRows) {
  Recording arm = elbow(4000, 1, kLinear);
  arm.channels.push_back({"wrist.estimate", "rad", Role::kJointEstimate, "wrist"});
  arm.channels.push_back({"wrist.truth", "rad", Role::kJointTruth, "wrist"});
  arm.samples.conservativeResize(Eigen::NoChange, 8);
  arm.samples.col(6) = -arm.samples.col(0);
  arm.samples.col(7) = arm.samples.col(6).array() - 0.3;
  arm.samples.col(1).head(2000).setConstant(kLost);
  arm.samples.col(7).tail(2000).setConstant(kLost);
  const auto choice = choose({arm});
  ASSERT_TRUE(choice.ok()) << choice.error().message;
  ASSERT_EQ(choice->model.outputs.size(), 2U);
  EXPECT_NEAR(choice->model.output.mean[1], -0.3, 1e-9);
  const Recording* const recordings[] = {&arm};
  const auto rows = make_rows(choice->model.features, choice->model.outputs, recordings, 0.01);
  ASSERT_TRUE(rows.ok());
  const Eigen::MatrixXd left = rows->errors - choice->model.predict(rows->inputs.cast<double>());
  EXPECT_LT(left.col(0).tail(2000).cwiseAbs().maxCoeff(), 0.003);
  EXPECT_LT(left.col(1).head(2000).cwiseAbs().maxCoeff(), 0.003);
}

TEST(Choice, KeepsThePositionOfAMeanOverTravelAmongTheInputs) {
  Recording arm = elbow(3000, 1, kLinear);
  arm.samples.col(1) = arm.samples.col(0) + 0.05 * arm.samples.col(2);
  ChoiceOptions options;
  options.features = "elbow.estimate,elbow.torque%0.001:elbow.estimate";
  const auto choice = choose({arm}, options);
  ASSERT_TRUE(choice.ok()) << choice.error().message;
  std::vector<std::string> texts;
  for (const model::FeatureSpec& feature : choice->model.features) texts.push_back(feature.text());
  EXPECT_EQ(std::count(texts.begin(), texts.end(), "elbow.estimate"), 1);
  EXPECT_EQ(texts.size(), 2U);
}

TEST(Choice, SaysWhichJointHasNoTruth) {
  Recording arm = elbow(300, 1, kLinear);
  arm.samples.col(1).setConstant(kLost);
  const auto choice = choose({arm});
  ASSERT_FALSE(choice.ok());
  EXPECT_NE(choice.error().message.find("joint elbow"), std::string::npos)
      << choice.error().message;
}

TEST(Choice, EndsWithWhatWasTriedWhenStopped) {
  const Recording arm = elbow(2000, 1, kCurve);
  const Recording* const recordings[] = {&arm};
  int asked = 0;
  const auto choice =
      choose_model(recordings, {}, [&](double, const std::string&) { return ++asked <= 1; });
  ASSERT_TRUE(choice.ok()) << choice.error().message;
  EXPECT_TRUE(choice->interrupted);
  EXPECT_EQ(choice->joints[0].tried.size(), 2U);  // the bias and one candidate
  EXPECT_LT(rmse_on(choice->model, arm), 0.2);
}

TEST(Choice, TableNamesEveryJointCandidateAndChoice) {
  const auto choice = choose({elbow(2000, 1, kLinear)});
  ASSERT_TRUE(choice.ok());
  const std::string table = choice_table(*choice);
  for (const char* words : {"elbow, RMSE in deg", "95 % interval", "outside", "bias removed",
                            "1.00", "elbow: linear, own inputs as they are"}) {
    EXPECT_NE(table.find(words), std::string::npos) << words << " is missing in\n" << table;
  }
}

TEST(OfferedInputs, LeaveOutTruthLoadsDesiredValuesAndVelocities) {
  const Recording arm = elbow(500, 1, kLinear);
  const Recording* const recordings[] = {&arm};
  const auto sets = offered_inputs(recordings, {{{"elbow", "elbow.estimate", "rad"}}});
  ASSERT_TRUE(sets.ok()) << sets.error().message;
  for (const model::FeatureSpec& feature : sets->features) {
    EXPECT_TRUE(feature.channel == "elbow.estimate" || feature.channel == "elbow.torque")
        << feature.text();
  }
}

TEST(OfferedInputs, OnARavenCloseNoLoop) {
  Recording arm = elbow(500, 1, kLinear);
  arm.channels[0] = {"jpos.elbow", "rad", Role::kJointEstimate, "elbow"};
  arm.channels[2] = {"tau.elbow", "N_m", Role::kDriveTorque, "elbow"};
  ASSERT_TRUE(core::catalogue_index_of("tau.elbow").has_value());
  const Recording* const recordings[] = {&arm};
  const auto sets = offered_inputs(recordings, {{{"elbow", "jpos.elbow", "rad"}}});
  ASSERT_TRUE(sets.ok());
  for (const model::FeatureSpec& feature : sets->features) EXPECT_EQ(feature.channel, "jpos.elbow");
}

TEST(Assemble, OneNetworkComputesTheSumOfItsParts) {
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd scaled(800, 4);
  for (double& value : scaled.reshaped()) value = normal(generator);
  std::vector<Part> parts;
  for (const auto& [output, units, columns] :
       std::vector<std::tuple<Eigen::Index, Eigen::Index, std::vector<Eigen::Index>>>{
           {0, 0, {0, 2}}, {0, 20, {1, 2, 3}}, {1, 0, {3}}}) {
    const Basis basis = draw({columns, units, 0.7, 9});
    Eigen::VectorXd readout(basis.size());
    for (double& value : readout) value = 0.1 * normal(generator);
    parts.push_back({output, basis, readout});
  }
  model::CalibrationModel model;
  model.features.resize(4);
  model.outputs.resize(2);
  model.input = {Eigen::VectorXd::Zero(4), Eigen::VectorXd::Ones(4)};
  model.output = {Eigen::Vector2d(0.3, -2.0), Eigen::Vector2d(0.5, 4.0)};
  model.layers = layers_of(parts, scaled, model.output);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(800, 2);
  for (const Part& part : parts) sum.col(part.output) += part.basis.design(scaled) * part.readout;
  EXPECT_LT((model.predict(scaled) - sum).cwiseAbs().maxCoeff(), 1e-4);
  const Eigen::VectorXd spread = (sum.rowwise() - sum.colwise().mean()).colwise().norm() / 28.0;
  EXPECT_GT(spread.minCoeff(), 0.05);
}

}  // namespace
}  // namespace ravencal::choice
