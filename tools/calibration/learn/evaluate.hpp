// SPDX-License-Identifier: Apache-2.0
//
// How well a model corrects recordings: per joint the error (estimate - truth) as it is, after the
// training mean is taken off, and after the correction.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "learn/shared_seeds.hpp"
#include "model/calibration_model.hpp"
#include "record/recording.hpp"

namespace ravencal::learn {

struct ErrorStatistics {
  double rmse = 0.0;
  double peak = 0.0;  ///< largest magnitude
};

/// Of values + shift against the truth; NaN if there are no values.
ErrorStatistics error_statistics(const std::vector<double>& values,
                                 const std::vector<double>& truth, double shift);

/// The corrected estimate on rows within and beyond the speeds and loads of the training
/// (motion_range.hpp). RMSE: NaN without rows.
struct MotionSplit {
  double within_rmse = 0.0;
  double beyond_rmse = 0.0;
  std::size_t rows_beyond = 0;
};

/// One joint over all rows that have its truth, its estimate and every feature. SI units.
struct JointEvaluation {
  std::string joint;
  std::string unit;  ///< "rad" or "m"
  ErrorStatistics raw;
  ErrorStatistics bias_removed;
  ErrorStatistics calibrated;
  std::vector<double> distance;  ///< of the inputs from the training; empty: unknown
  double distance_rank = 0.0;    ///< learn/distance_rank.hpp; NaN: unknown
  double confidence = 1.0;       ///< mean of the rows: the share of the correction that is applied
  std::optional<model::ExpectedError> expected;
  double rmse_about_mean = 0.0;  ///< calibrated, with each recording's mean error taken off
  std::vector<double> t_s;       ///< since the recording's start; falls where the next one begins
  std::vector<double> truth;
  std::vector<double> estimate;
  std::vector<double> corrected;
  double bias = 0.0;                  ///< mean of truth - estimate in training
  std::vector<bool> beyond;           ///< per row: beyond the training's motion; or empty
  std::optional<MotionSplit> motion;  ///< none: the model does not say what its training showed
};

/// Sets the figures from truth, estimate, corrected values, times and bias; NaN without rows.
void set_figures(JointEvaluation& joint);

struct Evaluation {
  std::vector<JointEvaluation> joints;
  std::size_t rows = 0;
  std::size_t rows_without_feature = 0;  ///< left out
  SharedSeeds shared;                    ///< with the training; set by who tests, for the table
};

/// Errors (kData): channels are missing, or a joint has no usable row.
core::Result<Evaluation> evaluate(const model::CalibrationModel& model,
                                  std::span<const record::Recording* const> recordings);

/// The sentence of a joint whose correction makes its error larger; both RMSE in `unit_si`.
std::string worse_than_raw(const std::string& joint, const std::string& unit_si, double rmse,
                           double raw_rmse);

/// Sentences on joints whose error the model makes larger.
std::vector<std::string> warnings_of(const Evaluation& evaluation);

/// The same, with what makes the evaluation less of a test: rows that lack a feature, recordings
/// that the model was trained on.
std::vector<std::string> warnings_of(const Evaluation& evaluation,
                                     const model::CalibrationModel& model,
                                     std::span<const record::Recording* const> recordings);

/// The contract's JSON (deg, mm), and the table that the commands print.
std::string evaluation_json(const Evaluation& evaluation);
std::string evaluation_table(const Evaluation& evaluation);

}  // namespace ravencal::learn
