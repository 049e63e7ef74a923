// SPDX-License-Identifier: Apache-2.0
#include "learn/train.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "core/version.hpp"
#include "learn/dataset.hpp"
#include "learn/linear.hpp"
#include "learn/motion_range.hpp"
#include "learn/recording_origin.hpp"
#include "learn/recordings_at_hook.hpp"
#include "learn/shared_seeds.hpp"
#include "learn/simulated.hpp"
#include "model/hook_view.hpp"
#include "model/jacobian.hpp"
#include "model/layers.hpp"
#include "model/scaled_inputs.hpp"

namespace ravencal::learn {
namespace {

using model::CalibrationModel;
using record::Recording;

/// Scaled samples in the precision and with the arithmetic of the robot.
Samples<float> scaled_samples(const CalibrationModel& model, const Dataset& data) {
  Samples<float> samples;
  samples.inputs = model::scaled_inputs<float>(model, data.features.transpose());
  const Eigen::VectorXd inverse_output = model.output.scale.cwiseInverse();
  Eigen::MatrixXd targets(data.errors.cols(), data.errors.rows());
  model::standardise(model.output.mean, inverse_output, data.errors.transpose(), targets);
  samples.targets = targets.cast<float>();
  return samples;
}

std::vector<std::string> names_of(const std::vector<model::FeatureSpec>& features,
                                  const std::vector<Eigen::Index>& indices) {
  std::vector<std::string> names;
  names.reserve(indices.size());
  for (const Eigen::Index index : indices) {
    names.push_back(features[static_cast<std::size_t>(index)].text());
  }
  return names;
}

core::Result<std::vector<model::FeatureSpec>> features_of(const TrainOptions& options,
                                                          const Recording& recording) {
  RAVENCAL_ASSIGN_OR_RETURN(std::vector<model::FeatureSpec> features,
                            model::select_features(options.features, recording.channels));
  const std::vector<model::FeatureSpec> plain = features;
  model::add_play(features, options.play, recording.channels);
  if (!options.play.empty() && features.size() == plain.size()) {
    return core::Error{core::ErrorCode::kUsage,
                       "--play: none of the features is a position; play operators are of joint, "
                       "motor and desired positions"};
  }
  model::add_history(features, options.history, options.history_step);
  return features;
}

void describe(const TrainOptions& options, TrainResult& result) {
  auto& provenance = result.model.provenance;
  const TrainerSettings& s = options.trainer;
  const Penalties& p = s.penalties;
  provenance["ravencal_version"] = core::kVersion;
  provenance["features"] = options.features.empty() ? "(default)" : options.features;
  provenance["rows"] = fmt::format("{}", result.rows);
  if (options.loop_noise > 0.0) provenance["loop_noise"] = fmt::format("{}", options.loop_noise);
  if (options.hidden.empty()) {
    provenance["settings"] = fmt::format("linear regression, ridge {}", options.ridge);
    return;
  }
  provenance["seed"] = fmt::format("{}", s.seed);
  provenance["kept_epoch"] = fmt::format("{}", result.kept_epoch);
  provenance["settings"] = fmt::format(
      "hidden {}; epochs {}; batch {}; tile {}; Adam {} {} {} {}; L1 {} L2 {} biases L2 {} "
      "activity L2 {}; {} kernels",
      fmt::join(options.hidden, ","), s.epochs, s.batch, s.tile, s.adam.learning_rate, s.adam.beta1,
      s.adam.beta2, s.adam.epsilon, p.l1_weights, p.l2_weights, p.l2_biases, p.l2_activity,
      name_of(s.isa));
}

/// Everything of the model but its layers.
/// The bias is that of the recordings; `all` has the simulated rows as well.
void fit_borders(const Dataset& recorded, const Dataset& all, TrainResult& result) {
  CalibrationModel& model = result.model;
  const std::vector<Eigen::Index> constant_inputs = fit_inputs(all.features, model);
  Scaling outputs = fit_scaling(Eigen::Ref<const Eigen::MatrixXd>(recorded.errors));
  model.output = std::move(outputs.standardiser);
  if (!constant_inputs.empty()) {
    result.warnings.push_back(fmt::format(
        "{} feature(s) never change in training and keep scale 1: {}", constant_inputs.size(),
        fmt::join(names_of(model.features, constant_inputs), ", ")));
  }
  const std::size_t dropped = result.rows_without_truth + result.rows_without_feature;
  if (dropped > 0) {
    result.warnings.push_back(fmt::format(
        "{} of {} rows are left out: {} lack the truth or the estimate of a joint, {} lack a "
        "feature",
        dropped, dropped + result.rows, result.rows_without_truth, result.rows_without_feature));
  }
}

/// Layers fitted to data in units of its own; epochs only where there are hidden layers.
struct Fitted {
  std::vector<model::DenseLayer> layers;
  FitResult course;
};

/// Noise per input, [features]: options.loop_noise where the input answers to the motor command.
Eigen::VectorXf noise_of(const TrainOptions& options, const CalibrationModel& model) {
  Eigen::VectorXf noise = Eigen::VectorXf::Zero(static_cast<Eigen::Index>(model.features.size()));
  for (const std::size_t i : model::answering_features(model)) {
    noise[static_cast<Eigen::Index>(i)] = static_cast<float>(options.loop_noise);
  }
  return noise;
}

core::Result<Fitted> fitted_to(const Dataset& data, const Dataset* held_out,
                               const TrainOptions& options, const TrainerSettings& settings,
                               const std::function<bool(const EpochReport&)>& keep_going,
                               const CalibrationModel& units) {
  const Samples<float> samples = scaled_samples(units, data);
  const Eigen::VectorXf noise = noise_of(options, units);
  if (options.hidden.empty()) {
    const Eigen::VectorXd ridge = noise.cast<double>().cwiseAbs2().array() + options.ridge;
    return Fitted{{fit_linear(samples.inputs.transpose().cast<double>(),
                              samples.targets.transpose().cast<double>(), ridge)},
                  {}};
  }
  TrainerSettings with_noise = settings;
  if (options.loop_noise > 0.0) with_noise.input_noise.assign(noise.begin(), noise.end());
  Samples<float> held_out_samples;
  if (held_out != nullptr) held_out_samples = scaled_samples(units, *held_out);
  const Shape shape(samples.inputs.rows(), options.hidden, samples.targets.rows(),
                    options.activation);
  Fitted fitted;
  fitted.course = fit(shape, with_noise, samples, held_out != nullptr ? &held_out_samples : nullptr,
                      keep_going);
  for (const float parameter : fitted.course.parameters) {
    if (!std::isfinite(parameter)) {
      return core::Error{
          core::ErrorCode::kData,
          "training diverged: a weight is not finite; lower --learning-rate, or look "
          "for outliers with `ravencal info`"};
    }
  }
  fitted.layers = layers_from(shape, fitted.course.parameters);
  return fitted;
}

model::Standardiser units_of(const Dataset& data) {
  return fit_scaling(Eigen::Ref<const Eigen::MatrixXd>(data.errors)).standardiser;
}

/// The network of the simulated rows, in the model's units. The constant of a simulation belongs to
/// its homing, so the network learns only how the error varies.
core::Result<Fitted> fit_simulated(const Dataset& simulated, const TrainOptions& options,
                                   const std::function<bool(const EpochReport&)>& keep_going,
                                   const CalibrationModel& model) {
  CalibrationModel units = model;
  units.output = units_of(simulated);
  TrainerSettings settings = options.simulated_trainer;
  settings.seed = options.trainer.seed;
  settings.threads = options.trainer.threads;
  settings.isa = options.trainer.isa;
  RAVENCAL_ASSIGN_OR_RETURN(Fitted fitted,
                            fitted_to(simulated, nullptr, options, settings, keep_going, units));
  units.output.mean = model.output.mean;
  fitted.layers = in_units_of(model.output, units.output, std::move(fitted.layers));
  return fitted;
}

void take(Fitted fitted, TrainResult& result) {
  result.model.layers = std::move(fitted.layers);
  result.epochs = std::move(fitted.course.epochs);
  result.kept_epoch = fitted.course.kept_epoch;
  result.interrupted = fitted.course.interrupted;
}

core::Status fit_layers(const Dataset& data, const Dataset* held_out, const TrainOptions& options,
                        const std::function<bool(const EpochReport&)>& keep_going,
                        TrainResult& result) {
  RAVENCAL_ASSIGN_OR_RETURN(
      Fitted fitted, fitted_to(data, held_out, options, options.trainer, keep_going, result.model));
  take(std::move(fitted), result);
  return {};
}

/// A second network learns the recorded error that the simulation's network leaves.
core::Status fit_beside_simulated(const Dataset& data, const Dataset& simulated,
                                  const Dataset* held_out, const TrainOptions& options,
                                  const std::function<bool(const EpochReport&)>& keep_going,
                                  TrainResult& result) {
  CalibrationModel& model = result.model;
  RAVENCAL_ASSIGN_OR_RETURN(Fitted base, fit_simulated(simulated, options, keep_going, model));
  model.layers = base.layers;
  const Dataset left = left_by(model, data);
  Dataset held_out_left;
  if (held_out != nullptr) held_out_left = left_by(model, *held_out);
  CalibrationModel units = model;
  units.output = units_of(left);
  RAVENCAL_ASSIGN_OR_RETURN(Fitted beside,
                            fitted_to(left, held_out != nullptr ? &held_out_left : nullptr, options,
                                      options.trainer, keep_going, units));
  const model::Standardiser added{Eigen::VectorXd::Zero(model.output.mean.size()),
                                  model.output.scale};
  beside.layers = sum_of(base.layers, in_units_of(added, units.output, std::move(beside.layers)));
  beside.course.interrupted = beside.course.interrupted || base.course.interrupted;
  take(std::move(beside), result);
  return {};
}

/// Gives the constant alone to a joint that the layers leave no better than its constant does. An
/// error that never changes is one: a network learns nothing from it.
void keep_constants(const Dataset& data, TrainResult& result) {
  constexpr Eigen::Index kRows = 4096;  // bounds the memory of the hidden layers
  const Eigen::Index stride = std::max<Eigen::Index>(1, data.features.rows() / kRows);
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < data.features.rows(); row += stride) rows.push_back(row);
  CalibrationModel& model = result.model;
  const Eigen::MatrixXd errors = data.errors(rows, Eigen::all);
  const model::FeatureMatrix inputs = data.features(rows, Eigen::all);
  const Eigen::MatrixXd left = model.predict(inputs.cast<double>()) - errors;
  model::DenseLayer& last = model.layers.back();
  for (Eigen::Index k = 0; k < errors.cols(); ++k) {
    const double constant = (errors.col(k).array() - model.output.mean[k]).square().mean();
    if (left.col(k).squaredNorm() / static_cast<double>(left.rows()) < constant) continue;
    last.weights.row(k).setZero();
    last.biases[k] = 0.0F;
    result.warnings.push_back(
        fmt::format("joint {}: training found nothing better than the mean of the error, and the "
                    "model has that alone",
                    model.outputs[static_cast<std::size_t>(k)].joint));
  }
}

/// Of what chose the epoch, and of what was simulated for the training, the model keeps the seeds
/// as well: their wander has left its mark, too.
void keep_names(std::span<const Recording* const> training,
                std::span<const Recording* const> validation,
                std::span<const Recording* const> simulated, CalibrationModel& model) {
  for (const auto& recordings : {training, validation, simulated}) {
    for (model::RandomSeeds& seeds : seeds_of(recordings)) model.seeds.push_back(std::move(seeds));
  }
  model.provenance["recordings"] = files_text(training);
  if (!validation.empty()) model.provenance["validation"] = files_text(validation);
}

}  // namespace

core::Result<TrainResult> train_model(std::span<const Recording* const> recorded_training,
                                      std::span<const Recording* const> recorded_validation,
                                      const TrainOptions& options,
                                      const std::function<bool(const EpochReport&)>& keep_going) {
  if (recorded_training.empty())
    return core::Error{core::ErrorCode::kUsage, "no recording to train on"};
  const bool at_hook = is_at_hook(options.latched, *recorded_training.front());
  const RecordingsAtHook training_at_hook(recorded_training, at_hook);
  const RecordingsAtHook validation_at_hook(recorded_validation, at_hook);
  const std::span<const Recording* const> training = training_at_hook.get();
  const std::span<const Recording* const> validation = validation_at_hook.get();
  TrainResult result;
  CalibrationModel& model = result.model;
  RAVENCAL_ASSIGN_OR_RETURN(model.origin, common_origin(options.origin, training));
  RAVENCAL_ASSIGN_OR_RETURN(model.origin, common_origin(model.origin, validation));
  RAVENCAL_ASSIGN_OR_RETURN(model.features, features_of(options, *training.front()));
  RAVENCAL_ASSIGN_OR_RETURN(model.outputs, outputs_of(*training.front(), options.joints));
  model.row_period_s = model::row_period_s(*training.front());
  RAVENCAL_ASSIGN_OR_RETURN(const Dataset data, make_dataset(model.features, model.outputs,
                                                             training, model.row_period_s));
  RAVENCAL_RETURN_IF_ERROR(
      check_row_count(training.front()->source, data.features.rows(), data.features.cols()));
  result.rows = static_cast<std::size_t>(data.features.rows());
  result.rows_without_truth = data.rows_without_truth;
  result.rows_without_feature = data.rows_without_feature;
  const RecordingsAtHook simulated_at_hook(options.simulated, at_hook);
  Dataset simulated, held_out;
  if (!options.simulated.empty()) {
    RAVENCAL_ASSIGN_OR_RETURN(simulated, make_dataset(model.features, model.outputs,
                                                      simulated_at_hook.get(), model.row_period_s));
  }
  if (!validation.empty()) {
    RAVENCAL_ASSIGN_OR_RETURN(
        held_out, make_dataset(model.features, model.outputs, validation, model.row_period_s));
  }
  const Dataset* chooses = validation.empty() ? nullptr : &held_out;
  if (options.simulated.empty()) {
    fit_borders(data, data, result);
    RAVENCAL_RETURN_IF_ERROR(fit_layers(data, chooses, options, keep_going, result));
  } else {
    fit_borders(data, joined(data, simulated), result);
    RAVENCAL_RETURN_IF_ERROR(
        fit_beside_simulated(data, simulated, chooses, options, keep_going, result));
  }
  keep_constants(data, result);
  model.loop_gains = model::loop_gains(model, data.features);
  result.drawn_rows = model::evenly_drawn(data.features, model::kLoopGainRows);
  model.motion = motion_range(model.outputs, training);
  describe(options, result);
  if (at_hook) model::set_trained_at_hook(model);
  keep_names(training, validation, options.simulated, model);
  return result;
}

}  // namespace ravencal::learn
