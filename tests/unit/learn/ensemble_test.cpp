// SPDX-License-Identifier: Apache-2.0
#include "learn/ensemble.hpp"

#include <gtest/gtest.h>

#include "unit/learn/sample_arm.hpp"

namespace ravencal::learn {
namespace {

TrainOptions small_network() {
  TrainOptions options;
  options.hidden = {6, 5};
  options.trainer.epochs = 3;
  options.trainer.batch = 64;
  return options;
}

bool keep_going(const EpochReport& /*epoch*/) { return true; }

TEST(Ensemble, PredictsTheMeanOfItsNetworks) {
  const record::Recording arm = sample_arm(300, 1);
  const record::Recording* const training[] = {&arm};
  const TrainOptions options = small_network();
  const auto averaged = train_ensemble(training, {}, options, 3, keep_going);
  ASSERT_TRUE(averaged.ok()) << averaged.error().message;

  const auto features = static_cast<Eigen::Index>(averaged->model.features.size());
  const Eigen::MatrixXd inputs = Eigen::MatrixXd::Random(20, features);
  Eigen::MatrixXd mean =
      Eigen::MatrixXd::Zero(20, static_cast<Eigen::Index>(averaged->model.outputs.size()));
  for (std::uint64_t i = 0; i < 3; ++i) {
    TrainOptions one = options;
    one.trainer.seed = options.trainer.seed + 10 * i;
    const auto single = train_model(training, {}, one, keep_going);
    ASSERT_TRUE(single.ok());
    mean += single->model.predict(inputs) / 3.0;
  }
  // Sums of single-precision weights in another order.
  EXPECT_LT((averaged->model.predict(inputs) - mean).cwiseAbs().maxCoeff(),
            1e-5 * mean.cwiseAbs().maxCoeff());
}

TEST(Ensemble, StopsWithTheNetworksThatWereFinished) {
  const record::Recording arm = sample_arm(300, 1);
  const record::Recording* const training[] = {&arm};
  int epochs = 0;
  const auto result = train_ensemble(training, {}, small_network(), 3,
                                     [&](const EpochReport&) { return ++epochs < 5; });
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_TRUE(result->interrupted);
  EXPECT_EQ(result->model.layers.front().biases.size(), 6);
}

}  // namespace
}  // namespace ravencal::learn
