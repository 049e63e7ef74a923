// SPDX-License-Identifier: Apache-2.0
#include "model/layers.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "model/scaled_inputs.hpp"
#include "model/single_precision.hpp"

namespace ravencal::model {
namespace {

TEST(Layers, ActivationsAreWhatTheirNamesSay) {
  const std::vector<double> values = {-30.0, -2.0, -0.5, 0.0, 0.1, 3.0, 30.0};
  for (const double z : values) {
    const auto apply = [&](Activation activation) {
      Eigen::Matrix<double, 1, 1> sum(z);
      activate(activation, sum);
      return sum[0];
    };
    EXPECT_EQ(apply(Activation::kLinear), z);
    EXPECT_NEAR(apply(Activation::kSigmoid), 1.0 / (1.0 + std::exp(-z)), 1e-15);
    EXPECT_NEAR(apply(Activation::kTanh), std::tanh(z), 1e-15);
    EXPECT_EQ(apply(Activation::kRelu), std::max(z, 0.0));
  }
}

TEST(Layers, DenseIsTheSumOverInputsPlusBias) {
  const Eigen::MatrixXd weights = Eigen::MatrixXd::Random(4, 3);
  const Eigen::VectorXd biases = Eigen::VectorXd::Random(4);
  const Eigen::MatrixXd x = Eigen::MatrixXd::Random(3, 5);
  Eigen::MatrixXd y(4, 5);
  dense(weights, biases, Activation::kLinear, x, y);
  for (int row = 0; row < 4; ++row) {
    for (int sample = 0; sample < 5; ++sample) {
      double sum = biases[row];
      for (int k = 0; k < 3; ++k) sum += weights(row, k) * x(k, sample);
      EXPECT_NEAR(y(row, sample), sum, 1e-14);
    }
  }
}

TEST(ScaledInputs, AreClampedHalfAWidthBeyondTheTrainedRangeAndKeepWhatIsLost) {
  CalibrationModel model;
  model.input = {Eigen::Vector2d(1.0, 5.0), Eigen::Vector2d(2.0, 1.0)};
  model.input_min = Eigen::Vector2d(-1.0, 5.0);
  model.input_max = Eigen::Vector2d(3.0, 5.0);
  Eigen::MatrixXd values(2, 5);
  values << -100.0, -2.9, 4.9, 100.0, std::nan(""), 5.0, 6.0, 4.0, -1e9, 7.0;
  Eigen::MatrixXd expected(2, 5);
  expected << -2.0, -1.95, 1.95, 2.0, std::nan(""), 0.0, 0.0, 0.0, 0.0, 0.0;
  const Eigen::MatrixXd scaled = scaled_inputs<double>(model, values);
  EXPECT_TRUE(std::isnan(scaled(0, 4)));
  EXPECT_LT((scaled - expected).leftCols(4).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(scaled(1, 4), 0.0);
}

TEST(ScaledInputs, AreNotClampedWithoutTrainedRanges) {
  CalibrationModel model;
  model.input = {Eigen::VectorXd::Constant(1, 1.0), Eigen::VectorXd::Constant(1, 2.0)};
  EXPECT_EQ(scaled_inputs<float>(model, Eigen::MatrixXf::Constant(1, 1, 101.0F))(0, 0), 50.0F);
}

TEST(Layers, UnstandardiseUndoesStandardise) {
  const Eigen::VectorXd mean = Eigen::VectorXd::Random(3);
  const Eigen::VectorXd scale = Eigen::VectorXd::Random(3).cwiseAbs().array() + 0.1;
  const Eigen::VectorXd inverse = scale.cwiseInverse();
  const Eigen::MatrixXd values = Eigen::MatrixXd::Random(3, 4);
  Eigen::MatrixXd scaled(3, 4);
  standardise(mean, inverse, values, scaled);
  unstandardise(mean, scale, scaled);
  EXPECT_LT((scaled - values).cwiseAbs().maxCoeff(), 1e-15);
}

}  // namespace
}  // namespace ravencal::model
