// SPDX-License-Identifier: Apache-2.0
#include "learn/train.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <filesystem>

#include "core/version.hpp"
#include "learn/dataset.hpp"
#include "learn/file_hash.hpp"
#include "learn/linear.hpp"
#include "model/hook_view.hpp"
#include "model/layers.hpp"
#include "model/trust_fit.hpp"

namespace ravencal::learn {
namespace {

using model::CalibrationModel;
using record::Recording;

/// Scaled samples in the precision and with the arithmetic of the robot.
Samples<float> scaled_samples(const CalibrationModel& model, const Dataset& data) {
  Samples<float> samples;
  const Eigen::VectorXf mean = model.input.mean.cast<float>();
  const Eigen::VectorXf inverse_scale = model.input.scale.cwiseInverse().cast<float>();
  samples.inputs.resize(data.features.cols(), data.features.rows());
  model::standardise(mean, inverse_scale, data.features.transpose(), samples.inputs);
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

std::string files_text(std::span<const Recording* const> recordings) {
  std::vector<std::string> files;
  for (const Recording* recording : recordings) {
    const std::filesystem::path path(recording->source);
    const auto hash = sha256_of_file(path);
    files.push_back(
        fmt::format("{} sha256:{}", path.filename().string(), hash.ok() ? *hash : "unknown"));
  }
  return fmt::format("{}", fmt::join(files, "; "));
}

void describe(const TrainOptions& options, TrainResult& result) {
  auto& provenance = result.model.provenance;
  const TrainerSettings& s = options.trainer;
  const Penalties& p = s.penalties;
  provenance["ravencal_version"] = core::kVersion;
  provenance["features"] = options.features.empty() ? "(default)" : options.features;
  provenance["rows"] = fmt::format("{}", result.rows);
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
void fit_borders(const Dataset& data, TrainResult& result) {
  CalibrationModel& model = result.model;
  Scaling inputs = fit_scaling(data.features);
  Scaling outputs = fit_scaling(Eigen::Ref<const Eigen::MatrixXd>(data.errors));
  model.input = std::move(inputs.standardiser);
  model.output = std::move(outputs.standardiser);
  model.input_min = data.features.colwise().minCoeff().transpose().cast<double>();
  model.input_max = data.features.colwise().maxCoeff().transpose().cast<double>();
  model.trust = model::fit_trust_region(model.input, data.features);
  if (!inputs.constant.empty()) {
    result.warnings.push_back(fmt::format(
        "{} feature(s) never change in training and keep scale 1: {}", inputs.constant.size(),
        fmt::join(names_of(model.features, inputs.constant), ", ")));
  }
  for (const Eigen::Index index : outputs.constant) {
    result.warnings.push_back(fmt::format("the error of joint {} never changes in training",
                                          model.outputs[static_cast<std::size_t>(index)].joint));
  }
  const std::size_t dropped = result.rows_without_truth + result.rows_without_feature;
  if (dropped > 0) {
    result.warnings.push_back(fmt::format(
        "{} of {} rows are left out: {} lack the truth or the estimate of a joint, {} lack a "
        "feature",
        dropped, dropped + result.rows, result.rows_without_truth, result.rows_without_feature));
  }
}

/// Recordings as the network is to see them.
class Seen {
 public:
  Seen(std::span<const Recording* const> recordings, bool at_hook)
      : recordings_(recordings.begin(), recordings.end()) {
    if (!at_hook) return;
    changed_.reserve(recordings.size());
    for (const Recording*& recording : recordings_) {
      changed_.push_back(model::as_seen_at_hook(*recording));
      recording = &changed_.back();
    }
  }
  [[nodiscard]] std::span<const Recording* const> get() const { return recordings_; }

 private:
  std::vector<const Recording*> recordings_;
  std::vector<Recording> changed_;
};

/// Rows of a control cycle each, but for jitter.
bool has_every_cycle(const Recording& recording) {
  const double period_s = model::row_period_s(recording);
  return period_s > 0.5 * model::kControlCycleS && period_s < 1.5 * model::kControlCycleS;
}

core::Status fit_layers(const Dataset& data, std::span<const Recording* const> validation,
                        const TrainOptions& options,
                        const std::function<bool(const EpochReport&)>& keep_going,
                        TrainResult& result) {
  CalibrationModel& model = result.model;
  const Samples<float> samples = scaled_samples(model, data);
  if (options.hidden.empty()) {
    model.layers = {fit_linear(samples.inputs.transpose().cast<double>(),
                               samples.targets.transpose().cast<double>(), options.ridge)};
    return {};
  }
  Samples<float> held_out;
  if (!validation.empty()) {
    RAVENCAL_ASSIGN_OR_RETURN(
        const Dataset held_out_data,
        make_dataset(model.features, model.outputs, validation, model.row_period_s));
    held_out = scaled_samples(model, held_out_data);
  }
  const Shape shape(samples.inputs.rows(), options.hidden, samples.targets.rows(),
                    options.activation);
  FitResult fitted =
      fit(shape, options.trainer, samples, validation.empty() ? nullptr : &held_out, keep_going);
  for (const float parameter : fitted.parameters) {
    if (!std::isfinite(parameter)) {
      return core::Error{
          core::ErrorCode::kData,
          "training diverged: a weight is not finite; lower --learning-rate, or look "
          "for outliers with `ravencal info`"};
    }
  }
  model.layers = layers_from(shape, fitted.parameters);
  result.epochs = std::move(fitted.epochs);
  result.kept_epoch = fitted.kept_epoch;
  result.interrupted = fitted.interrupted;
  return {};
}

}  // namespace

core::Result<TrainResult> train_model(std::span<const Recording* const> recorded_training,
                                      std::span<const Recording* const> recorded_validation,
                                      const TrainOptions& options,
                                      const std::function<bool(const EpochReport&)>& keep_going) {
  if (recorded_training.empty())
    return core::Error{core::ErrorCode::kUsage, "no recording to train on"};
  const bool at_hook =
      options.latched == Latched::kOn ||
      (options.latched == Latched::kAuto && has_every_cycle(*recorded_training.front()));
  const Seen seen_training(recorded_training, at_hook);
  const Seen seen_validation(recorded_validation, at_hook);
  const std::span<const Recording* const> training = seen_training.get();
  const std::span<const Recording* const> validation = seen_validation.get();
  TrainResult result;
  CalibrationModel& model = result.model;
  RAVENCAL_ASSIGN_OR_RETURN(model.features, features_of(options, *training.front()));
  RAVENCAL_ASSIGN_OR_RETURN(model.outputs, outputs_of(*training.front(), options.joints));
  model.row_period_s = model::row_period_s(*training.front());
  RAVENCAL_ASSIGN_OR_RETURN(const Dataset data, make_dataset(model.features, model.outputs,
                                                             training, model.row_period_s));
  result.rows = static_cast<std::size_t>(data.features.rows());
  result.rows_without_truth = data.rows_without_truth;
  result.rows_without_feature = data.rows_without_feature;
  fit_borders(data, result);
  RAVENCAL_RETURN_IF_ERROR(fit_layers(data, validation, options, keep_going, result));
  describe(options, result);
  if (at_hook) model::set_trained_at_hook(model);
  model.provenance["recordings"] = files_text(training);
  if (!validation.empty()) model.provenance["validation"] = files_text(validation);
  return result;
}

}  // namespace ravencal::learn
