// SPDX-License-Identifier: Apache-2.0
//
// Backpropagation through time against finite differences, float against double, and the GRU as the
// plugin would run it.
#include <gtest/gtest.h>

#include <cmath>

#include "core/random.hpp"
#include "learn/aligned.hpp"
#include "methods/recurrent_kernels.hpp"
#include "unit/methods_sample.hpp"

namespace ravencal::test {
namespace {

using methods::Cell;
using methods::RecurrentShape;

learn::AlignedVector<double> draw(std::ptrdiff_t count, std::uint64_t seed, double size) {
  core::Random random(seed);
  learn::AlignedVector<double> values(static_cast<std::size_t>(count));
  for (double& value : values) value = size * (2.0 * random.uniform() - 1.0);
  return values;
}

struct Case {
  Cell cell;
  std::ptrdiff_t dense;
};

class Recurrent : public ::testing::TestWithParam<Case> {
 protected:
  static constexpr std::ptrdiff_t kSamples = 5;
  RecurrentShape shape_{GetParam().cell, 3, 4, GetParam().dense, 2, 6};
  learn::AlignedVector<double> parameters_ = draw(shape_.parameter_count(), 1, 0.8);
  learn::AlignedVector<double> inputs_ = draw(shape_.inputs * shape_.window * kSamples, 2, 1.5);
  learn::AlignedVector<double> targets_ = draw(shape_.outputs * kSamples, 3, 1.0);
};

TEST_P(Recurrent, GradientIsThatOfFiniteDifferences) {
  const auto& kernels = methods::recurrent_double_kernels();
  learn::AlignedVector<double> gradient(parameters_.size());
  learn::AlignedVector<double> ignored(parameters_.size());
  const auto loss = [&](learn::AlignedVector<double>& into) {
    return kernels.gradient(shape_, parameters_.data(), inputs_.data(), targets_.data(), kSamples,
                            into.data());
  };
  EXPECT_GT(loss(gradient), 0.0);
  constexpr double kStep = 1e-5;
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    const double value = parameters_[i];
    parameters_[i] = value + kStep;
    const double up = loss(ignored);
    parameters_[i] = value - kStep;
    const double down = loss(ignored);
    parameters_[i] = value;
    EXPECT_NEAR(gradient[i], (up - down) / (2.0 * kStep), 1e-8) << "parameter " << i;
  }
}

TEST_P(Recurrent, FloatKernelsOfEveryInstructionSetAgreeWithDouble) {
  learn::AlignedVector<double> expected(targets_.size());
  methods::recurrent_double_kernels().forward(shape_, parameters_.data(), inputs_.data(), kSamples,
                                              expected.data());
  const learn::AlignedVector<float> parameters(parameters_.begin(), parameters_.end());
  const learn::AlignedVector<float> inputs(inputs_.begin(), inputs_.end());
  for (const learn::Isa isa : {learn::Isa::kBaseline, learn::Isa::kAvx2, learn::Isa::kAvx512}) {
    if (!learn::is_supported(isa)) continue;
    learn::AlignedVector<float> outputs(expected.size());
    methods::recurrent_kernels(isa).forward(shape_, parameters.data(), inputs.data(), kSamples,
                                            outputs.data());
    for (std::size_t i = 0; i < expected.size(); ++i)
      EXPECT_NEAR(static_cast<double>(outputs[i]), expected[i], 2e-5) << learn::name_of(isa);
  }
}

INSTANTIATE_TEST_SUITE_P(Cells, Recurrent,
                         ::testing::Values(Case{Cell::kGru, 0}, Case{Cell::kGru, 3},
                                           Case{Cell::kLstm, 0}, Case{Cell::kLstm, 3}));

TEST(Gru, ModelForThePluginGivesWhatThePredictorGives) {
  const std::vector<methods::Series> train = {sample_series(400, 1, linear_error)};
  methods::Settings settings = quick_settings();
  settings.gru_units = 5;  // no whole line: the blocks of the gates are padded
  const auto predictor = method("gru").fit(sample_problem(), train, settings);
  ASSERT_TRUE(predictor.ok());
  const model::CalibrationModel* model = (*predictor)->model();
  ASSERT_NE(model, nullptr);
  // model.predict holds each row over the whole window; so does a series that stands still.
  methods::Series still = sample_series(60, 2, linear_error);
  still.inputs.rowwise() = still.inputs.row(7).eval();
  const Eigen::MatrixXd streamed = (*predictor)->predict(still);
  const Eigen::MatrixXd held = model->predict(still.inputs.bottomRows(1));
  EXPECT_LT((streamed.bottomRows(1) - held).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_EQ(model->layers[1].stride_rows, 5U) << "50 ms of rows 10 ms apart";
  EXPECT_EQ(model->layers[1].window, 8);
}

}  // namespace
}  // namespace ravencal::test
