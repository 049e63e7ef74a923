// SPDX-License-Identifier: Apache-2.0
#include "learn/simulated.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "learn/train.hpp"
#include "unit/learn/sample_arm.hpp"

namespace ravencal::learn {
namespace {

bool never_stop(const EpochReport& /*epoch*/) { return true; }

TrainOptions tiny_network() {
  TrainOptions options;
  options.hidden = {8, 6};
  options.trainer.epochs = 2;
  options.trainer.batch = 64;
  return options;
}

double rmse(const model::CalibrationModel& model, const record::Recording& recording) {
  const record::Recording* const one[] = {&recording};
  const auto data = make_dataset(model.features, model.outputs, one, model.row_period_s);
  const Eigen::MatrixXd left = left_by(model, *data).errors;
  const Eigen::RowVectorXd scale = model.output.scale.transpose();
  return std::sqrt((left.array().rowwise() / scale.array()).square().mean());
}

TEST(Simulated, SumPredictsWhatBothPredict) {
  const record::Recording arm = sample_arm(300, 1);
  const record::Recording* const training[] = {&arm};
  TrainOptions options = tiny_network();
  const auto a = train_model(training, {}, options, never_stop);
  options.trainer.seed = 99;
  const auto b = train_model(training, {}, options, never_stop);
  ASSERT_TRUE(a.ok() && b.ok());
  model::CalibrationModel sum = a->model;
  sum.layers = sum_of(a->model.layers, b->model.layers);
  const Eigen::MatrixXd inputs =
      Eigen::MatrixXd::Random(20, static_cast<Eigen::Index>(sum.features.size()));
  const Eigen::MatrixXd wanted =
      (a->model.predict(inputs) + b->model.predict(inputs)).rowwise() - sum.output.mean.transpose();
  EXPECT_LT((sum.predict(inputs) - wanted).cwiseAbs().maxCoeff(),
            1e-5 * wanted.cwiseAbs().maxCoeff());
}

TEST(Simulated, ServesMotionThatTheRecordingLacks) {
  // The recording is too short to learn from; the simulation is not.
  record::Recording arm = sample_arm(60, 1);
  record::Recording simulation = sample_arm(4000, 2);
  const record::Recording test = sample_arm(1000, 3);
  const record::Recording* const training[] = {&arm};
  TrainOptions options = tiny_network();
  options.trainer.epochs = 20;
  const auto plain = train_model(training, {}, options, never_stop);
  options.simulated = {&simulation};
  options.simulated_trainer.epochs = 100;
  options.simulated_trainer.adam.learning_rate = 5e-3;
  const auto with = train_model(training, {}, options, never_stop);
  ASSERT_TRUE(plain.ok() && with.ok());
  EXPECT_LT(rmse(with->model, test), 0.7 * rmse(plain->model, test));
  EXPECT_EQ(with->model.layers.size(), plain->model.layers.size());
  EXPECT_EQ(with->model.layers.front().biases.size(), 16);
}

}  // namespace
}  // namespace ravencal::learn
