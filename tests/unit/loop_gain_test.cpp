// SPDX-License-Identifier: Apache-2.0
//
// The derivatives of a model and the gains of the loop that its inputs close.
#include <gtest/gtest.h>

#include <cstdlib>

#include "model/jacobian.hpp"
#include "model/loop_group.hpp"

namespace ravencal::test {
namespace {

using model::Activation;
using model::LoopGroup;
using model::Transform;

/// A network of these activations with random weights, two outputs.
model::CalibrationModel network(const std::vector<model::FeatureSpec>& features,
                                const std::vector<Activation>& activations) {
  std::srand(11);  // Eigen's Random
  const auto n = static_cast<Eigen::Index>(features.size());
  model::CalibrationModel model;
  model.features = features;
  model.input.mean = Eigen::VectorXd::Random(n);
  model.input.scale = Eigen::VectorXd::Random(n).cwiseAbs().array() + 0.2;
  model.input_min = Eigen::VectorXd::Constant(n, -2.0);
  model.input_max = Eigen::VectorXd::Constant(n, 2.0);
  Eigen::Index inputs = n;
  for (const Activation activation : activations) {
    const Eigen::Index outputs = model.layers.size() + 1 == activations.size() ? 2 : 7;
    model.layers.push_back(
        {Eigen::MatrixXf::Random(outputs, inputs), Eigen::VectorXf::Random(outputs), activation});
    inputs = outputs;
  }
  model.output.mean = Eigen::Vector2d(0.1, -0.002);
  model.output.scale = Eigen::Vector2d(0.02, 1e-4);
  model.outputs = {{"elbow", "jpos.elbow", "rad"}, {"insertion", "jpos.insertion", "m"}};
  return model;
}

/// y = gains * x: mean 0, scale as given, one linear layer.
model::CalibrationModel linear(const std::vector<model::FeatureSpec>& features,
                               const Eigen::MatrixXd& gains, double input_scale) {
  model::CalibrationModel model = network(features, {Activation::kLinear});
  model.input.mean.setZero();
  model.input.scale.setConstant(input_scale);
  model.layers[0].weights = (gains * input_scale).cast<float>();
  model.layers[0].biases.setZero();
  model.output.mean.setZero();
  model.output.scale.setOnes();
  return model;
}

TEST(Jacobian, IsTheDifferenceOfPredictionsForEveryActivation) {
  const model::CalibrationModel model =
      network({{"tau.elbow"}, {"jpos.elbow"}, {"mvel.elbow"}},
              {Activation::kSigmoid, Activation::kTanh, Activation::kRelu, Activation::kLinear});
  const model::FeatureMatrix rows = model::FeatureMatrix::Random(300, 3);
  const auto slopes = model::jacobians(model, rows);
  ASSERT_EQ(slopes.size(), 300U);
  constexpr double kStep = 1e-6;
  for (Eigen::Index i = 0; i < 3; ++i) {
    Eigen::MatrixXd above = rows.cast<double>();
    Eigen::MatrixXd below = above;
    above.col(i).array() += kStep;
    below.col(i).array() -= kStep;
    const Eigen::MatrixXd expected = (model.predict(above) - model.predict(below)) / (2.0 * kStep);
    int far = 0;
    for (Eigen::Index row = 0; row < 300; ++row) {
      const Eigen::VectorXd found = slopes[static_cast<std::size_t>(row)].col(i);
      const double size = model.output.scale.maxCoeff();
      if ((found - expected.row(row).transpose()).norm() > 1e-6 * size) ++far;
    }
    EXPECT_LE(far, 2) << "input " << i << ": more than rows at a kink of relu";
  }
}

TEST(Jacobian, IsZeroByAnInputThatThePluginClamps) {
  model::CalibrationModel model =
      network({{"tau.elbow"}, {"jpos.elbow"}}, {Activation::kTanh, Activation::kLinear});
  model.input_min[1] = model.input_max[1] = 0.25;  // a constant of the training
  model::FeatureMatrix rows(2, 2);
  rows << 5.0F, 0.25F, 3.0F, 0.25F;
  const auto slopes = model::jacobians(model, rows);
  EXPECT_TRUE(slopes[0].isZero(0.0));
  EXPECT_GT(slopes[1].col(0).cwiseAbs().minCoeff(), 0.0);
  EXPECT_TRUE(slopes[1].col(1).isZero(0.0));
}

TEST(Jacobian, OfAGruIsThatOfARowHeldOverItsWindow) {
  std::srand(5);
  model::CalibrationModel model = network({{"tau.elbow"}, {"jpos.elbow"}}, {Activation::kLinear});
  const Eigen::Index units = 4;
  model::DenseLayer input{Eigen::MatrixXf::Random(3 * units, 2),
                          Eigen::VectorXf::Random(3 * units)};
  input.kind = model::packed::LayerKind::kGruInput;
  model::DenseLayer state{Eigen::MatrixXf::Random(3 * units, units),
                          Eigen::VectorXf::Random(3 * units)};
  state.kind = model::packed::LayerKind::kGruRecurrent;
  state.window = 3;
  state.stride_rows = 1;
  model.layers = {input, state, {Eigen::MatrixXf::Random(2, units), Eigen::VectorXf::Random(2)}};
  model::FeatureMatrix rows(1, 2);
  rows << 0.3F, -0.4F;
  const Eigen::MatrixXd slope = model::jacobians(model, rows).front();
  Eigen::MatrixXd moved = rows.cast<double>();
  moved(0, 1) += 1e-6;
  const Eigen::RowVectorXd expected =
      (model.predict(moved) - model.predict(rows.cast<double>())) / 1e-6;
  EXPECT_LT((slope.col(1).transpose() - expected).norm(), 1e-5 * model.output.scale.maxCoeff());
}

TEST(LoopGroup, NamesTheFieldsThatAnswerAndOnlyThoseOfJointsOneToThree) {
  EXPECT_EQ(model::loop_group_of("tau.shoulder"), LoopGroup::kTorque);
  EXPECT_EQ(model::loop_group_of("dac.insertion"), LoopGroup::kTorque);
  EXPECT_EQ(model::loop_group_of("mvel.elbow"), LoopGroup::kVelocity);
  EXPECT_EQ(model::loop_group_of("jvel.elbow"), LoopGroup::kVelocity);
  EXPECT_EQ(model::loop_group_of("mpos_d.elbow"), LoopGroup::kDesired);
  EXPECT_EQ(model::loop_group_of("jpos_d.elbow"), LoopGroup::kDesired);
  EXPECT_EQ(model::loop_group_of("pos_d.x"), LoopGroup::kDesired);
  for (const char* silent : {"jpos.elbow", "mpos.elbow", "pos.x", "enc.elbow", "runlevel",
                             "tau.wrist", "other.tau.elbow", "grasp_d", "elbow.torque"}) {
    EXPECT_FALSE(model::loop_group_of(silent).has_value()) << silent;
  }
}

TEST(LoopGains, AreTheLargestOverRowsWithLagsAndPlaysAddedUp) {
  Eigen::MatrixXd gains(2, 5);
  gains << 0.5, -0.25, 1.0, 0.0, 2.0,  //
      -0.1, 0.2, 0.0, 3.0, 4.0;
  const model::CalibrationModel model = linear({{"tau.elbow"},
                                                {"tau.elbow", Transform::kLag, 2},
                                                {"mpos_d.elbow", Transform::kPlay, 0, 0.01F},
                                                {"mvel.elbow"},
                                                {"jpos.elbow"}},
                                               gains, 0.5);
  const auto found = model::loop_gains(model, model::FeatureMatrix::Random(10, 5));
  EXPECT_EQ(found.rows, 10U);
  ASSERT_EQ(found.channels, (std::vector<std::string>{"tau.elbow", "mpos_d.elbow", "mvel.elbow"}));
  Eigen::MatrixXd largest(2, 3);
  largest << 0.75, 1.0, 0.0, 0.3, 0.0, 3.0;
  EXPECT_LT((found.largest - largest).norm(), 1e-6);
  Eigen::MatrixXd by_group(2, 3);  // torque, velocity, desired; times the scale of 0.5
  by_group << 0.375, 0.0, 0.5, 0.15, 1.5, 0.0;
  EXPECT_LT((found.by_group - by_group).norm(), 1e-6);
}

TEST(LoopGains, CountAMeanAsItsChannel) {
  Eigen::MatrixXd gains(2, 3);
  gains << 0.5, -0.25, 1.0,  //
      -0.1, 0.2, 0.0;
  const model::CalibrationModel model =
      linear({{"tau.elbow", Transform::kMean, 0, 0.0F, 0.5F},
              {"tau.elbow", Transform::kMeanOfAbs, 0, 0.0F, 100.0F},
              {"jpos.elbow", Transform::kMean, 0, 0.0F, 0.5F}},
             gains, 0.5);
  EXPECT_EQ(model::answering_features(model), (std::vector<std::size_t>{0, 1}));
  const auto found = model::loop_gains(model, model::FeatureMatrix::Random(10, 3));
  ASSERT_EQ(found.channels, std::vector<std::string>{"tau.elbow"});
  EXPECT_NEAR(found.largest(0, 0), 0.75, 1e-6);
  EXPECT_NEAR(found.largest(1, 0), 0.3, 1e-6);
  EXPECT_NEAR(found.by_group(0, static_cast<int>(LoopGroup::kTorque)), 0.375, 1e-6);
}

TEST(LoopGains, CountAMeanOverTravelAsItsChannelAndNotAsItsPosition) {
  Eigen::MatrixXd gains(2, 3);
  gains << 0.5, -0.25, 1.0,  //
      -0.1, 0.2, 0.0;
  const model::CalibrationModel model =
      linear({{"tau.elbow", Transform::kTravelMean, 0, 0.0F, 0.0F, 0.5F, "jpos.elbow"},
              {"jpos.elbow", Transform::kTravelMeanOfAbs, 0, 0.0F, 0.0F, 0.5F, "mpos_d.elbow"},
              {"jpos.elbow"}},
             gains, 0.5);
  EXPECT_EQ(model::answering_features(model), std::vector<std::size_t>{0});
  const auto found = model::loop_gains(model, model::FeatureMatrix::Random(10, 3));
  ASSERT_EQ(found.channels, std::vector<std::string>{"tau.elbow"});
  EXPECT_NEAR(found.largest(0, 0), 0.5, 1e-6);
  EXPECT_NEAR(found.by_group(0, static_cast<int>(LoopGroup::kTorque)), 0.25, 1e-6);
  EXPECT_EQ(found.by_group(0, static_cast<int>(LoopGroup::kDesired)), 0.0);
}

TEST(LoopGains, OfANetworkGrowWithTheSteepestRow) {
  model::CalibrationModel model =
      network({{"tau.elbow"}}, {Activation::kTanh, Activation::kLinear});
  model::FeatureMatrix flat(1, 1);
  flat << 1000.0F;  // saturated
  model::FeatureMatrix both(2, 1);
  both << 1000.0F, 0.0F;
  EXPECT_LT(model::loop_gains(model, flat).largest.maxCoeff(),
            1e-3 * model::loop_gains(model, both).largest.maxCoeff());
}

TEST(LoopGains, OfAModelWithoutSuchInputsAreZero) {
  const model::CalibrationModel model =
      network({{"jpos.elbow"}, {"mpos.elbow"}}, {Activation::kTanh, Activation::kLinear});
  EXPECT_TRUE(model::answering_features(model).empty());
  const auto gains = model::loop_gains(model, model::FeatureMatrix::Random(5, 2));
  EXPECT_TRUE(gains.channels.empty());
  EXPECT_EQ(gains.by_group, Eigen::MatrixXd::Zero(2, 3));
}

TEST(LoopGains, LightOpenHasNoInputThatAnswers) {
  using record::Role;
  std::vector<record::Channel> channels;
  for (const char* name : {"jpos.shoulder", "jpos.elbow", "jpos.insertion", "tau.elbow"}) {
    channels.push_back({name, "rad", Role::kFeature, ""});
  }
  const auto features = model::select_features("light-open", channels);
  ASSERT_TRUE(features.ok()) << features.error().message;
  EXPECT_EQ(features->size(), 9U);
  for (const model::FeatureSpec& feature : *features) {
    EXPECT_FALSE(model::loop_group_of(feature.channel).has_value()) << feature.text();
  }
  EXPECT_EQ(model::select_features("light-open,-jpos.elbow", channels)->size(), 6U);
  EXPECT_EQ(model::select_features("light-open,tau.elbow", channels)->size(), 10U);
  channels.erase(channels.begin());
  const auto lacking = model::select_features("light-open", channels);
  ASSERT_FALSE(lacking.ok());
  EXPECT_NE(lacking.error().message.find("jpos.shoulder"), std::string::npos);
}

TEST(LoopGains, LookAtRowsFromTheWholeRecording) {
  model::FeatureMatrix rows(10000, 1);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) rows(i, 0) = static_cast<float>(i);
  const model::FeatureMatrix drawn = model::evenly_drawn(rows, 4);
  ASSERT_EQ(drawn.rows(), 4);
  EXPECT_EQ(drawn(0, 0), 0.0F);
  EXPECT_EQ(drawn(3, 0), 7500.0F);
}

}  // namespace
}  // namespace ravencal::test
