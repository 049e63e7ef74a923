// SPDX-License-Identifier: Apache-2.0
//
// Noise on inputs that answer to the motor command: a penalty on the gain of the loop they close.
#include <gtest/gtest.h>

#include <random>

#include "learn/train.hpp"
#include "model/jacobian.hpp"

namespace ravencal::learn {
namespace {

using record::Recording;
using record::Role;

/// error = 0.02 tau + 0.02 jpos of the elbow; both inputs independent, of spread 1.
Recording elbow(int rows) {
  Recording recording;
  recording.source = "elbow.db";
  recording.channels = {{"jpos.elbow", "rad", Role::kJointEstimate, "elbow"},
                        {"truth.elbow", "rad", Role::kJointTruth, "elbow"},
                        {"tau.elbow", "N_m", Role::kDriveTorque, "elbow"}};
  recording.samples.resize(rows, 3);
  std::mt19937_64 generator(8);
  std::uniform_real_distribution<double> draw(-std::sqrt(3.0), std::sqrt(3.0));
  for (int row = 0; row < rows; ++row) {
    recording.t_ns.push_back(row * 10'000'000LL);
    const double position = draw(generator);
    const double torque = draw(generator);
    recording.samples.row(row) << position, position + 0.02 * torque + 0.02 * position, torque;
  }
  return recording;
}

model::CalibrationModel trained(double noise, std::vector<std::uint32_t> hidden,
                                unsigned threads = 1) {
  const Recording recording = elbow(4000);
  const Recording* const recordings[] = {&recording};
  TrainOptions options;
  options.features = "jpos.elbow,tau.elbow";
  options.hidden = std::move(hidden);
  options.loop_noise = noise;
  options.trainer.epochs = 60;
  options.trainer.batch = 512;
  options.trainer.tile = 128;
  options.trainer.threads = threads;
  options.trainer.adam.learning_rate = 3e-3;
  auto result = train_model(recordings, {}, options, [](const EpochReport&) { return true; });
  EXPECT_TRUE(result.ok()) << result.error().message;
  return result->model;
}

/// Mean derivatives of the correction: by jpos, by tau.
Eigen::RowVector2d slopes(const model::CalibrationModel& model) {
  const model::FeatureMatrix rows = model::FeatureMatrix::Random(200, 2);
  Eigen::RowVector2d sum = Eigen::RowVector2d::Zero();
  for (const Eigen::MatrixXd& slope : model::jacobians(model, rows)) sum += slope.row(0);
  return sum / 200.0;
}

TEST(LoopNoise, ShrinksALinearGainAsItsVarianceSays) {
  // Least squares under noise of variance s^2 on an input of variance 1: the weight falls to
  // 1 / (1 + s^2). The position's stays.
  const Eigen::RowVector2d without = slopes(trained(0.0, {}));
  EXPECT_NEAR(without[1], 0.02, 1e-5);
  const Eigen::RowVector2d with = slopes(trained(1.0, {}));
  EXPECT_NEAR(with[1], 0.01, 2e-4);
  EXPECT_NEAR(with[0], 0.02, 3e-4);
}

TEST(LoopNoise, ShrinksTheGainOfANetworkAsMuch) {
  const Eigen::RowVector2d without = slopes(trained(0.0, {16}));
  const Eigen::RowVector2d with = slopes(trained(1.0, {16}));
  EXPECT_NEAR(without[1], 0.02, 0.002);
  EXPECT_NEAR(with[1], 0.01, 0.002);
  EXPECT_NEAR(with[0], 0.02, 0.003);
}

TEST(LoopNoise, GivesTheSameWeightsWithAnyNumberOfThreads) {
  const model::CalibrationModel one = trained(2.0, {16}, 1);
  const model::CalibrationModel three = trained(2.0, {16}, 3);
  EXPECT_EQ(one.layers[0].weights, three.layers[0].weights);
  EXPECT_EQ(one.layers[1].biases, three.layers[1].biases);
}

TEST(LoopNoise, TheModelSaysItsGains) {
  const model::CalibrationModel model = trained(0.0, {});
  ASSERT_TRUE(model.loop_gains.has_value());
  EXPECT_EQ(model.loop_gains->channels, std::vector<std::string>{"tau.elbow"});
  EXPECT_NEAR(model.loop_gains->largest(0, 0), 0.02, 1e-5);
  EXPECT_EQ(model.loop_gains->rows, 4000U);
}

}  // namespace
}  // namespace ravencal::learn
