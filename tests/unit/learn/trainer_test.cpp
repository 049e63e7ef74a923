// SPDX-License-Identifier: Apache-2.0
#include "learn/trainer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "unit/learn/reference.hpp"

namespace ravencal::learn {
namespace {

constexpr const char* kNoReference =
    "the independent reference (mlp_reference.json) is not in RAVENCAL_REFERENCE_DIR";

template <typename Scalar>
void expect_reference_gradient(const Reference& reference, TrainerSettings settings,
                               double tolerance) {
  Trainer<Scalar> trainer(reference.shape, settings, reference.parameters);
  std::vector<Scalar> gradient(reference.gradient.size());
  const Loss loss = trainer.loss_and_gradient(samples_as<Scalar>(reference.samples), gradient);
  EXPECT_NEAR(loss.mean_squared_error, reference.mean_squared_error,
              tolerance * reference.mean_squared_error);
  EXPECT_NEAR(loss.penalty, reference.penalty, tolerance * reference.penalty);
  EXPECT_LT(relative_difference<Scalar>(gradient, reference.gradient), tolerance);
}

template <typename Scalar>
void expect_reference_weights(const Reference& reference, TrainerSettings settings,
                              double tolerance) {
  Trainer<Scalar> trainer(reference.shape, settings, reference.parameters);
  const Samples<Scalar> samples = samples_as<Scalar>(reference.samples);
  for (int step = 0; step < 10; ++step) trainer.run_epoch(samples);  // one batch each
  EXPECT_LT(relative_difference<Scalar>(trainer.parameters(), reference.parameters_after_10),
            tolerance);
}

TEST(Trainer, GivesTheLossAndGradientOfTheReferenceInDouble) {
  const auto reference = load_reference();
  if (!reference) GTEST_SKIP() << kNoReference;
  expect_reference_gradient<double>(*reference, reference->settings, 1e-12);
}

TEST(Trainer, GivesTheLossAndGradientOfTheReferenceWithEveryInstructionSet) {
  const auto reference = load_reference();
  if (!reference) GTEST_SKIP() << kNoReference;
  for (const Isa isa : {Isa::kBaseline, Isa::kAvx2, Isa::kAvx512}) {
    if (!is_supported(isa)) continue;
    SCOPED_TRACE(name_of(isa));
    TrainerSettings settings = reference->settings;
    settings.isa = isa;
    expect_reference_gradient<float>(*reference, settings, 1e-5);
  }
}

TEST(Trainer, GivesTheSameGradientWhenABatchIsCutIntoUnequalTiles) {
  const auto reference = load_reference();
  if (!reference) GTEST_SKIP() << kNoReference;
  TrainerSettings settings = reference->settings;
  for (const std::uint32_t tile : {1U, 3U, 4U, 10U}) {
    settings.tile = tile;
    expect_reference_gradient<double>(*reference, settings, 1e-12);
  }
}

TEST(Trainer, ArrivesAtTheReferencesWeightsAfterTenAdamSteps) {
  const auto reference = load_reference();
  if (!reference) GTEST_SKIP() << kNoReference;
  // Shuffling permutes the sums of a full batch, so the last digits may differ.
  expect_reference_weights<double>(*reference, reference->settings, 1e-10);
  for (const Isa isa : {Isa::kBaseline, Isa::kAvx2, Isa::kAvx512}) {
    if (!is_supported(isa)) continue;
    SCOPED_TRACE(name_of(isa));
    TrainerSettings settings = reference->settings;
    settings.isa = isa;
    expect_reference_weights<float>(*reference, settings, 1e-5);
  }
}

/// Random samples and slightly large penalties, so that each term of the gradient shows.
struct Problem {
  explicit Problem(model::Activation activation)
      : shape(5, std::vector<std::uint32_t>{7, 6}, 2, activation) {
    settings.penalties = {1e-2, 2e-2, 3e-2, 4e-2};
    settings.tile = 8;
    std::srand(7);
    samples.inputs.setRandom(5, 21);
    samples.targets.setRandom(2, 21);
    parameters = initial_parameters(shape, 11);
    for (double& p : parameters) p += p != 0.0 ? 0.05 : 0.0;  // away from the kink of L1 at 0
  }

  double loss() const {
    Trainer<double> trainer(shape, settings, parameters);
    std::vector<double> gradient(parameters.size());
    const Loss loss = trainer.loss_and_gradient(samples, gradient);
    return loss.mean_squared_error + loss.penalty;
  }

  Shape shape;
  TrainerSettings settings;
  Samples<double> samples;
  std::vector<double> parameters;
};

class TrainerGradient : public testing::TestWithParam<model::Activation> {};

TEST_P(TrainerGradient, AgreesWithCentralDifferences) {
  Problem problem(GetParam());
  Trainer<double> trainer(problem.shape, problem.settings, problem.parameters);
  std::vector<double> gradient(problem.parameters.size());
  (void)trainer.loss_and_gradient(problem.samples, gradient);
  // Central differences: truncation h^2, rounding eps/h; both below 1e-9 at h = 1e-6.
  constexpr double kStep = 1e-6;
  std::size_t checked = 0;
  for (std::size_t i = 0; i < problem.parameters.size(); ++i) {
    const double kept = problem.parameters[i];
    if (std::abs(kept) < 1e-3) continue;  // padding, biases and the kinks near 0
    problem.parameters[i] = kept + kStep;
    const double above = problem.loss();
    problem.parameters[i] = kept - kStep;
    const double below = problem.loss();
    problem.parameters[i] = kept;
    EXPECT_NEAR(gradient[i], (above - below) / (2.0 * kStep), 1e-8) << "parameter " << i;
    ++checked;
  }
  EXPECT_GT(checked, 80U);
}

INSTANTIATE_TEST_SUITE_P(EveryActivation, TrainerGradient,
                         testing::Values(model::Activation::kSigmoid, model::Activation::kTanh,
                                         model::Activation::kRelu, model::Activation::kLinear));

/// A few epochs whose last batch is short and whose last tile is short.
std::vector<float> trained(unsigned threads, std::uint64_t seed, Isa isa) {
  const Shape shape(9, std::vector<std::uint32_t>{40, 24}, 3, model::Activation::kSigmoid);
  TrainerSettings settings;
  settings.batch = 200;
  settings.tile = 32;
  settings.threads = threads;
  settings.seed = seed;
  settings.isa = isa;
  settings.epochs = 4;
  std::srand(5);
  Samples<float> samples;
  samples.inputs.setRandom(9, 1037);
  samples.targets = samples.inputs.topRows(3).array().square();
  return fit(shape, settings, samples, nullptr, [](const EpochReport&) { return true; }).parameters;
}

TEST(Trainer, GivesTheSameBitsOnAnyNumberOfThreads) {
  for (const Isa isa : {Isa::kBaseline, Isa::kAvx2, Isa::kAvx512}) {
    if (!is_supported(isa)) continue;
    const std::vector<float> one = trained(1, 3, isa);
    for (const unsigned threads : {2U, 3U, 5U, 16U}) {
      EXPECT_EQ(trained(threads, 3, isa), one) << name_of(isa) << ", " << threads << " threads";
    }
  }
}

TEST(Trainer, GivesOtherWeightsForAnotherSeed) {
  EXPECT_NE(trained(1, 3, best_isa()), trained(1, 13, best_isa()));
}

TEST(Trainer, KeepsPaddingBetweenLayersAtZero) {
  const Shape shape(9, std::vector<std::uint32_t>{40, 24}, 3, model::Activation::kSigmoid);
  const std::vector<float> parameters = trained(2, 3, best_isa());
  for (const LayerShape& layer : shape.layers()) {
    for (auto i = layer.weights + layer.inputs * layer.outputs; i < layer.biases; ++i) {
      EXPECT_EQ(parameters[static_cast<std::size_t>(i)], 0.0F);
    }
  }
}

TEST(Trainer, LearnsASmoothFunction) {
  const Shape shape(2, std::vector<std::uint32_t>{16}, 1, model::Activation::kTanh);
  TrainerSettings settings;
  settings.epochs = 200;
  settings.batch = 32;
  settings.adam.learning_rate = 5e-3;
  std::srand(9);
  Samples<float> samples;
  samples.inputs.setRandom(2, 600);
  samples.targets = (2.0F * samples.inputs.row(0)).array().sin() * samples.inputs.row(1).array();
  const FitResult result =
      fit(shape, settings, samples, nullptr, [](const EpochReport&) { return true; });
  EXPECT_EQ(result.kept_epoch, 200U);
  EXPECT_LT(result.epochs.back().training, 0.05 * result.epochs.front().training);
}

/// Validation samples that contradict the training samples: their loss rises from some epoch on.
TEST(Trainer, KeepsTheEpochThatTheValidationSamplesLikeBest) {
  const Shape shape(3, std::vector<std::uint32_t>{12}, 1, model::Activation::kSigmoid);
  TrainerSettings settings;
  settings.epochs = 40;
  settings.batch = 16;
  settings.adam.learning_rate = 2e-2;
  std::srand(2);
  Samples<float> training;
  training.inputs.setRandom(3, 64);
  training.targets = training.inputs.row(0);
  Samples<float> validation = training;
  validation.targets *= 0.5F;
  const FitResult result =
      fit(shape, settings, training, &validation, [](const EpochReport&) { return true; });
  const auto best = std::min_element(
      result.epochs.begin(), result.epochs.end(),
      [](const EpochReport& a, const EpochReport& b) { return a.validation < b.validation; });
  EXPECT_EQ(result.kept_epoch, best->epoch);
  EXPECT_LT(result.kept_epoch, 40U);
  Trainer<float> kept(shape, settings,
                      std::vector<double>(result.parameters.begin(), result.parameters.end()));
  EXPECT_NEAR(kept.mean_squared_error(validation), best->validation, 1e-6 * best->validation);
}

TEST(Trainer, StopsWhenAskedAndSaysSo) {
  const Shape shape(3, std::vector<std::uint32_t>{4}, 1, model::Activation::kSigmoid);
  TrainerSettings settings;
  settings.epochs = 50;
  Samples<float> samples;
  samples.inputs.setRandom(3, 30);
  samples.targets.setRandom(1, 30);
  const FitResult result = fit(shape, settings, samples, nullptr,
                               [](const EpochReport& report) { return report.epoch < 7; });
  EXPECT_TRUE(result.interrupted);
  EXPECT_EQ(result.kept_epoch, 7U);
  EXPECT_EQ(result.epochs.size(), 7U);
  EXPECT_FALSE(result.parameters.empty());
}

TEST(Shape, DrawsGlorotUniformWeightsAndZeroBiases) {
  const Shape shape(300, std::vector<std::uint32_t>{200}, 3, model::Activation::kSigmoid);
  const std::vector<double> parameters = initial_parameters(shape, 23);
  const LayerShape& layer = shape.layers()[0];
  const double limit = std::sqrt(6.0 / 500.0);
  double largest = 0.0;
  double squares = 0.0;
  for (std::ptrdiff_t i = 0; i < 60000; ++i) {
    const double weight = parameters[static_cast<std::size_t>(layer.weights + i)];
    largest = std::max(largest, std::abs(weight));
    squares += weight * weight;
  }
  EXPECT_LE(largest, limit);
  EXPECT_GT(largest, 0.999 * limit);
  // Variance limit^2 / 3; the mean of 60 000 squares scatters by 0.4 % (1 sigma).
  EXPECT_NEAR(squares / 60000.0, limit * limit / 3.0, 0.02 * limit * limit / 3.0);
  for (std::ptrdiff_t i = 0; i < 200; ++i) {
    EXPECT_EQ(parameters[static_cast<std::size_t>(layer.biases + i)], 0.0);
  }
}

TEST(Shape, CountsThePapersParameters) {
  // 208*600+600 + 600*500+500 + 500*400+400 + 400*3+3, the authors' notebook.
  const Shape shape(208, std::vector<std::uint32_t>{600, 500, 400}, 3, model::Activation::kSigmoid);
  std::ptrdiff_t count = 0;
  for (const LayerShape& layer : shape.layers()) count += (layer.inputs + 1) * layer.outputs;
  EXPECT_EQ(count, 627503);
}

}  // namespace
}  // namespace ravencal::learn
