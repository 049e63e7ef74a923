// SPDX-License-Identifier: Apache-2.0
#include "methods/network.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cmath>

#include "learn/ensemble.hpp"
#include "learn/trainer.hpp"
#include "methods/blocked.hpp"
#include "methods/scaled_model.hpp"

namespace ravencal::methods {
namespace {

constexpr std::array kPenaltyScales = {0.01, 0.1, 1.0, 10.0, 30.0};
/// More rows than this do not overfit, and four folds of them take long.
constexpr Eigen::Index kMostRowsToChoose = 12000;

learn::TrainerSettings trainer_settings(const Settings& settings, double penalty_scale) {
  learn::TrainerSettings trainer;
  trainer.epochs = settings.epochs;
  trainer.batch = settings.batch;
  trainer.adam.learning_rate = settings.learning_rate;
  trainer.penalties.l1_weights *= penalty_scale;
  trainer.penalties.l2_weights *= penalty_scale;
  trainer.penalties.l2_biases *= penalty_scale;
  trainer.penalties.l2_activity *= penalty_scale;
  trainer.threads = settings.threads;
  return trainer;
}

}  // namespace

core::Result<model::CalibrationModel> train_network(const Problem& problem, const Stack& data,
                                                    const Settings& settings, double penalty_scale,
                                                    double done_from, double done_to) {
  if (data.errors.rows() == 0)
    return core::Error{core::ErrorCode::kData,
                       "no training row has every feature and every joint's error"};
  const auto columns = first_columns(data.inputs.cols());
  const model::CalibrationModel frame = frame_of(problem, columns, data);
  const learn::Samples<float> samples{scaled_inputs(frame, data).cast<float>(),
                                      scaled_errors(frame, data).cast<float>()};
  const learn::Shape shape(samples.inputs.rows(), settings.hidden, samples.targets.rows(),
                           settings.activation);
  learn::TrainerSettings trainer = trainer_settings(settings, penalty_scale);
  std::vector<model::CalibrationModel> models;
  const double all = static_cast<double>(settings.networks) * settings.epochs;
  for (std::uint32_t n = 0; n < settings.networks; ++n) {
    trainer.seed = settings.seed + 10 * n;
    const learn::FitResult fitted =
        learn::fit(shape, trainer, samples, nullptr, [&](const learn::EpochReport& epoch) {
          const double share = (static_cast<double>(n) * settings.epochs + epoch.epoch) / all;
          return settings.keep_going(done_from + (done_to - done_from) * share);
        });
    if (fitted.interrupted) return stopped();
    for (const float value : fitted.parameters) {
      if (!std::isfinite(value))
        return core::Error{core::ErrorCode::kData,
                           "training diverged: a weight is not finite; lower --learning-rate"};
    }
    models.push_back(frame);
    models.back().layers = learn::layers_from(shape, fitted.parameters);
  }
  model::CalibrationModel model = learn::average(models);
  model.provenance["settings"] =
      fmt::format("hidden {}; {} epochs; batch {}; penalties x {}; {} network(s); seed {}",
                  fmt::join(settings.hidden, ","), settings.epochs, settings.batch, penalty_scale,
                  settings.networks, settings.seed);
  return model;
}

core::Result<double> choose_penalty(const Problem& problem, std::span<const Series> train,
                                    Eigen::Index columns, const Settings& settings) {
  if (settings.penalty_scale > 0.0) return settings.penalty_scale;
  if (count_rows(train) > kMostRowsToChoose) return 1.0;
  Settings quick = settings;
  quick.networks = 1;
  RAVENCAL_ASSIGN_OR_RETURN(
      const std::size_t best,
      choose(train, kPenaltyScales.size(),
             [&](std::size_t c,
                 std::span<const Series> part) -> core::Result<std::unique_ptr<Predictor>> {
               RAVENCAL_ASSIGN_OR_RETURN(
                   model::CalibrationModel model,
                   train_network(problem, stack(part, columns), quick, kPenaltyScales[c], 0, 0.5));
               return model_predictor(std::move(model), first_columns(columns), {});
             }));
  return kPenaltyScales[best];
}

namespace {

class Network final : public Method {
 public:
  std::string_view id() const override { return "network"; }
  std::string_view title() const override { return "network"; }
  std::string_view source() const override { return "ravencal train"; }
  bool ours() const override { return true; }
  core::Result<std::unique_ptr<Predictor>> fit(const Problem& problem,
                                               std::span<const Series> train,
                                               const Settings& settings) const override {
    const auto columns = static_cast<Eigen::Index>(problem.features.size());
    RAVENCAL_ASSIGN_OR_RETURN(const double penalty,
                              choose_penalty(problem, train, columns, settings));
    RAVENCAL_ASSIGN_OR_RETURN(
        model::CalibrationModel model,
        train_network(problem, stack(train, columns), settings, penalty, 0.5, 1.0));
    return model_predictor(
        std::move(model), first_columns(columns),
        fmt::format("{} inputs, hidden {}, penalties x {:g}, {} network(s)", columns,
                    fmt::join(settings.hidden, "-"), penalty, settings.networks));
  }
};

}  // namespace

std::unique_ptr<Method> make_network() { return std::make_unique<Network>(); }

}  // namespace ravencal::methods
