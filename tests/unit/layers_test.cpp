// SPDX-License-Identifier: Apache-2.0
#include "model/layers.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "model/network.hpp"
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

// The compiled form against the one of any size, through padding: 5 of 7 inputs and 3 of 4 hidden
// units are used.
TEST(Layers, AFixedNetworkGivesTheSameThroughItsPadding) {
  struct Tag;
  using Network = FixedNetwork<Tag, 7, 4, 3>;
  constexpr NetworkShape kShape = Network::kShape;
  CalibrationModel model;
  model.input.mean = Eigen::VectorXd::Random(5);
  model.input.scale = Eigen::VectorXd::Random(5).cwiseAbs().array() + 0.5;
  model.input_min = Eigen::VectorXd::Constant(5, -1.0);
  model.input_max = Eigen::VectorXd::Constant(5, 1.0);
  model.layers = {{Eigen::MatrixXf::Random(3, 5), Eigen::VectorXf::Random(3), Activation::kSigmoid},
                  {Eigen::MatrixXf::Random(3, 3), Eigen::VectorXf::Random(3), Activation::kLinear}};
  model.output.mean = Eigen::VectorXd::Random(3);
  model.output.scale = Eigen::VectorXd::Random(3).cwiseAbs();

  std::vector<float> storage(kShape.arena_floats() + 64, 0.0F);
  void* start = storage.data();
  std::size_t space = storage.size() * sizeof(float);
  auto* const arena =
      static_cast<float*>(std::align(64, kShape.arena_floats() * sizeof(float), start, space));
  for (std::size_t i = 0; i < 5; ++i) {
    const auto e = static_cast<int>(i);
    arena[kShape.low_at() + i] = -2.0F;  // half a width beyond -1 and 1
    arena[kShape.high_at() + i] = 2.0F;
    arena[kShape.mean_at() + i] = static_cast<float>(model.input.mean[e]);
    arena[kShape.inverse_scale_at() + i] = static_cast<float>(1.0 / model.input.scale[e]);
  }
  for (std::size_t l = 0; l < 2; ++l) {
    const DenseLayer& layer = model.layers[l];
    for (int row = 0; row < layer.weights.rows(); ++row) {
      arena[kShape.biases_at(l) + static_cast<std::size_t>(row)] = layer.biases[row];
      for (int column = 0; column < layer.weights.cols(); ++column) {
        arena[kShape.weights_at(l) + static_cast<std::size_t>(column) * kShape.rows(l) +
              static_cast<std::size_t>(row)] = layer.weights(row, column);
      }
    }
  }
  for (std::size_t j = 0; j < 3; ++j) {
    arena[kShape.output_mean_at() + j] = static_cast<float>(model.output.mean[static_cast<int>(j)]);
    arena[kShape.output_scale_at() + j] =
        static_cast<float>(model.output.scale[static_cast<int>(j)]);
  }
  const Activation activations[] = {Activation::kSigmoid, Activation::kLinear};
  for (int sample = 0; sample < 100; ++sample) {
    alignas(64) float features[16] = {};
    // Three times the trained range: clamping is part of what must agree.
    const Eigen::VectorXf x = 3.0F * Eigen::VectorXf::Random(5);
    for (int i = 0; i < 5; ++i) features[i] = x[i];
    float outputs[3];
    Network::run(arena, activations, features, outputs);
    const Eigen::MatrixXf expected = predict_single(model, x);
    for (int j = 0; j < 3; ++j) {
      // Sums of 5 terms of size 1, in another order: a few units in the last place.
      EXPECT_NEAR(outputs[j], expected(j, 0), 2e-6);
    }
  }
}

}  // namespace
}  // namespace ravencal::model
