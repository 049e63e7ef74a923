// SPDX-License-Identifier: Apache-2.0
#include "model/compact.hpp"

#include <gtest/gtest.h>

#include <random>

namespace ravencal::model {
namespace {

constexpr Eigen::Index kInputs = 12;

/// A network of 12 inputs, 10 and 8 units, 2 outputs, with everything in use.
CalibrationModel busy_model() {
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  const auto fill = [&] { return normal(random); };
  CalibrationModel model;
  for (Eigen::Index i = 0; i < kInputs; ++i) {
    FeatureSpec feature;
    feature.channel = "channel" + std::to_string(i);
    model.features.push_back(feature);
  }
  model.input = {Eigen::VectorXd::LinSpaced(kInputs, -1.0, 1.0),
                 Eigen::VectorXd::LinSpaced(kInputs, 0.5, 2.0)};
  model.input_min = Eigen::VectorXd::Constant(kInputs, -9.0);
  model.input_max = Eigen::VectorXd::LinSpaced(kInputs, 1.0, 9.0);
  for (const auto& [outputs, inputs] : {std::pair{10, 12}, {8, 10}, {2, 8}}) {
    model.layers.push_back({Eigen::MatrixXf::NullaryExpr(outputs, inputs, fill),
                            Eigen::VectorXf::NullaryExpr(outputs, fill), Activation::kSigmoid});
  }
  model.layers.back().activation = Activation::kLinear;
  model.output = {Eigen::VectorXd::Constant(2, 0.1), Eigen::VectorXd::Constant(2, 0.01)};
  return model;
}

Eigen::MatrixXd rows_for(const CalibrationModel& model, Eigen::Index rows, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd features(rows, kInputs);
  for (Eigen::Index i = 0; i < kInputs; ++i) {
    for (Eigen::Index r = 0; r < rows; ++r) {
      features(r, i) = model.input.mean[i] + model.input.scale[i] * normal(random);
    }
  }
  return features;
}

Eigen::MatrixXd selected(const Eigen::MatrixXd& features, const std::vector<std::size_t>& columns) {
  return features(Eigen::all, columns);
}

TEST(Compact, LeavesANetworkWhoseEveryPartIsUsed) {
  const auto model = busy_model();
  const auto result = compact(model, {}, {});
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result.value().weights_after, result.value().weights_before);
  EXPECT_EQ(result.value().kept_inputs.size(), model.features.size());
}

TEST(Compact, RemovesUnreadInputsAndConstantOrUnreadUnitsWithoutChangingAnyOutput) {
  auto model = busy_model();
  model.features[5] = {"channel5", Transform::kMean, 0, 0.0F, 0.5F};
  model.layers[0].weights.col(4).setZero();  // input 4 is unread
  model.layers[0].weights.row(2).setZero();  // unit 2 is constant
  model.layers[1].weights.col(7).setZero();  // unit 7 is unread
  for (Eigen::Index unit = 0; unit < 10; ++unit) {
    if (unit != 7) model.layers[0].weights(unit, 9) = 0.0F;  // input 9 feeds only unit 7
  }
  const auto result = compact(model, {}, {});
  ASSERT_TRUE(result.ok());
  const Compacted& small = result.value();
  EXPECT_EQ(small.kept_inputs, (std::vector<std::size_t>{0, 1, 2, 3, 5, 6, 7, 8, 10, 11}));
  EXPECT_EQ(small.model.layers[0].weights.rows(), 8);
  EXPECT_EQ(small.model.features[4], model.features[5]);
  EXPECT_EQ(small.model.input_max[4], model.input_max[5]);
  const auto features = rows_for(model, 200, 5);
  const Eigen::MatrixXd before = model.predict(features);
  const Eigen::MatrixXd after = small.model.predict(selected(features, small.kept_inputs));
  EXPECT_LE((before - after).cwiseAbs().maxCoeff(),
            1e-8);  // a bias is rounded to 2^-24, scale 0.01
}

TEST(Compact, KeepsThePositionOfAMeanOverTravelEvenIfItIsUnread) {
  auto model = busy_model();
  model.features[5] = {"channel5", Transform::kTravelMean, 0, 0.0F, 0.0F, 0.5F, "channel4"};
  model.features[9] = {"channel9", Transform::kTravelMeanOfAbs, 0, 0.0F, 0.0F, 0.5F, "channel8"};
  for (const Eigen::Index unread : {3, 4, 8, 9}) model.layers[0].weights.col(unread).setZero();
  const std::vector<std::size_t> kept = {0, 1, 2, 4, 5, 6, 7, 10, 11};
  const auto exact = compact(model, {}, {});
  ASSERT_TRUE(exact.ok());
  EXPECT_EQ(exact.value().kept_inputs, kept) << "nothing goes by the travel of channel 8 any more";
  const auto within = compact(model, rows_for(model, 3000, 6).cast<float>(), {0.01});
  ASSERT_TRUE(within.ok());
  EXPECT_EQ(within.value().kept_inputs, kept);
  const auto features = rows_for(model, 200, 5);
  const Eigen::MatrixXd change =
      model.predict(features) - within.value().model.predict(selected(features, kept));
  EXPECT_LE(change.cwiseAbs().maxCoeff(), 1e-3) << "a tenth of the outputs' scale";
}

TEST(Compact, StaysWithinItsBudgetOnTheRowsAndNearItOnOthers) {
  auto model = busy_model();
  for (const Eigen::Index faint : {1, 3, 5, 7}) model.layers[0].weights.col(faint) *= 1e-3F;
  model.layers[1].weights.col(0) *= 1e-3F;
  for (const double budget : {0.001, 0.01, 0.1}) {
    const auto result = compact(model, rows_for(model, 3000, 6).cast<float>(), {budget});
    ASSERT_TRUE(result.ok());
    const Compacted& small = result.value();
    EXPECT_LT(small.weights_after, small.weights_before);
    EXPECT_LE(small.output_change, budget);
    const auto fresh = rows_for(model, 3000, 7);
    const Eigen::MatrixXd change =
        model.predict(fresh) - small.model.predict(selected(fresh, small.kept_inputs));
    const double rms = std::sqrt(change.colwise().squaredNorm().maxCoeff() / 3000.0) / 0.01;
    EXPECT_LE(rms, 1.3 * budget);
  }
}

TEST(Compact, KeepsAtLeastOneOfEverything) {
  const auto model = busy_model();
  const auto result = compact(model, rows_for(model, 100, 8).cast<float>(), {1e9});
  ASSERT_TRUE(result.ok());
  for (const DenseLayer& layer : result.value().model.layers) EXPECT_GE(layer.weights.size(), 1);
  EXPECT_EQ(result.value().model.features.size(), 1U);
  EXPECT_EQ(result.value().model.layers.back().weights.rows(), 2);
}

TEST(Compact, RefusesRowsThatDoNotFit) {
  const auto model = busy_model();
  EXPECT_FALSE(compact(model, FeatureMatrix::Zero(5, 3), {0.1}).ok());
  EXPECT_FALSE(compact(model, {}, {0.1}).ok());
  EXPECT_FALSE(compact(model, FeatureMatrix::Constant(5, kInputs, NAN), {0.1}).ok());
}

}  // namespace
}  // namespace ravencal::model
