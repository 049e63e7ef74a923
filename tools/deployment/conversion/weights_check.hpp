// SPDX-License-Identifier: Apache-2.0
//
// Accuracy that conversion costs: compares a trained model with its weights on one recording.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "model/calibration_model.hpp"
#include "record/recording.hpp"

namespace ravencal::conversion {

/// SI units throughout.
struct JointCheck {
  std::string joint;
  std::string unit;
  double largest_difference = 0.0;  ///< of the outputs, rows whose inputs are taken as they are
  double largest_clamped_difference = 0.0;  ///< rows with an input that the plugin clamps
  std::optional<double> model_rmse;         ///< of the corrected joint; none without a truth
  std::optional<double> weights_rmse;
  std::optional<double> raw_rmse;  ///< without any correction

  /// Of the RMSE, percent; none without a truth.
  [[nodiscard]] std::optional<double> rmse_change_percent() const;
  /// Whether the arm does better without these weights; false without a truth.
  [[nodiscard]] bool is_worse_than_raw() const;
};

struct WeightsCheck {
  std::size_t rows = 0;          ///< compared, of them:
  std::size_t rows_clamped = 0;  ///< with an input that the plugin clamps
  std::size_t rows_trusted = 0;  ///< with confidence 1
  std::size_t rows_doubted = 0;  ///< with confidence 0
  std::size_t rows_lost = 0;  ///< left out: an input is not a number, or a GRU's window not whole
  std::vector<JointCheck> joints;
};

/// `weights` may use some of the inputs of `model` only, and run as the plugin runs them. Errors
/// (kData): the recording lacks a channel.
core::Result<WeightsCheck> check_weights(const model::CalibrationModel& model,
                                         const model::CalibrationModel& weights,
                                         const record::Recording& recording);

}  // namespace ravencal::conversion
