// SPDX-License-Identifier: Apache-2.0
//
// From recordings to a calibration model: features, scaling, network. Scaling and ranges come from
// the training recordings only; validation recordings choose the epoch and nothing else.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "learn/recordings_at_hook.hpp"
#include "learn/trainer.hpp"
#include "model/calibration_model.hpp"
#include "model/feature_matrix.hpp"
#include "record/recording.hpp"

namespace ravencal::learn {

/// For simulated rows, which have no noise: many steps, and penalties of a hundredth.
inline TrainerSettings for_simulated() {
  TrainerSettings settings;
  settings.adam.learning_rate = 1e-3;
  settings.penalties = {1e-7, 1e-6, 1e-6, 1e-7};
  settings.batch = 256;
  settings.epochs = 20;
  return settings;
}

struct TrainOptions {
  std::string features;             ///< grammar: model::select_features
  std::vector<std::string> joints;  ///< outputs; empty: every joint that has a truth
  std::vector<std::uint32_t> hidden = {600, 500, 400};  ///< empty: linear regression
  model::Activation activation = model::Activation::kSigmoid;
  std::uint32_t history = 0;       ///< past copies of each feature
  std::uint32_t history_step = 1;  ///< rows between them
  std::vector<float> play;         ///< half-widths of play operators, SI units
  Latched latched = Latched::kAuto;
  model::Origin origin;  ///< given by the user; the recordings add the rest
  double ridge = 0.0;    ///< linear regression only, on scaled inputs
  /// Standard deviation of the noise, in spreads of each input, on inputs that answer to the motor
  /// command (model/loop_group.hpp): bounds the gain of the loop that they close. Linear regression
  /// gets the ridge that is equal to it, its square.
  double loop_noise = 0.0;
  TrainerSettings trainer;
  /// Recordings of a simulation of the arm; may be empty. One network learns them and is then
  /// fixed; the network of `hidden` learns the recorded error that it leaves. The model is their
  /// sum, one network of twice the width.
  std::vector<const record::Recording*> simulated;
  TrainerSettings simulated_trainer = for_simulated();  ///< its seed, threads, isa: of `trainer`
};

struct TrainResult {
  model::CalibrationModel model;
  std::vector<EpochReport> epochs;  ///< empty for linear regression
  std::uint32_t kept_epoch = 0;
  bool interrupted = false;
  std::size_t rows = 0;             ///< trained on
  model::FeatureMatrix drawn_rows;  ///< of the training, evenly drawn: where gains are computed
  std::size_t rows_without_truth = 0;
  std::size_t rows_without_feature = 0;
  std::vector<std::string> warnings;  ///< sentences
};

/// `keep_going` is called after each epoch; false stops with the best so far.
/// Errors: kUsage for features that do not exist, kData for recordings that do not fit, or that
/// are not of one arm, robot, controller and kind of coordinates.
core::Result<TrainResult> train_model(std::span<const record::Recording* const> training,
                                      std::span<const record::Recording* const> validation,
                                      const TrainOptions& options,
                                      const std::function<bool(const EpochReport&)>& keep_going);

}  // namespace ravencal::learn
