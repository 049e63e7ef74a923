// SPDX-License-Identifier: Apache-2.0
//
// What a network is trained on: features of every usable row, and the joint error (truth minus
// estimate) at that row. Rows with a lost value are left out and counted.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "model/calibration_model.hpp"
#include "model/feature_matrix.hpp"
#include "record/recording.hpp"

namespace ravencal::learn {

/// Where a row comes from.
struct RowOrigin {
  std::size_t recording = 0;
  Eigen::Index row = 0;
};

/// SI units throughout.
struct Dataset {
  model::FeatureMatrix features;         ///< [rows x features], all finite
  Eigen::MatrixXd errors;                ///< truth - estimate, [rows x outputs]
  std::vector<RowOrigin> origins;        ///< of each row
  std::size_t rows_without_truth = 0;    ///< left out: truth or estimate lost
  std::size_t rows_without_feature = 0;  ///< left out: truth known, but a feature lost
};

/// Which rows are usable, besides that every feature is known.
struct RowChoice {
  Eigen::Index stride = 1;  ///< of each recording, every so many-th row
  bool some_truth = false;  ///< the error of one output is enough; those of others may be NaN
};

/// Names of the joints that have a channel of that role, for messages.
std::string joints_with(const record::Recording& recording, record::Role role);

/// The recording's calibratable joints, or those of them that are named in `joints`.
/// Errors (kData): none, or one that is named has no truth or no estimate.
core::Result<std::vector<model::OutputSpec>> outputs_of(const record::Recording& recording,
                                                        std::span<const std::string> joints);

/// Truth minus estimate, [rows x outputs]; NaN where either is lost.
/// Errors (kData): the recording has no truth or no estimate of a joint.
core::Result<Eigen::MatrixXd> joint_errors(std::span<const model::OutputSpec> outputs,
                                           const record::Recording& recording);

/// Usable rows of all recordings, in order. `row_period_s` is the unit of lags. Features are made
/// from every row, also from those that the stride leaves out.
/// Errors (kData): a channel is missing, or no row is left; with `some_truth` the caller judges the
/// rows of each output.
core::Result<Dataset> make_dataset(std::span<const model::FeatureSpec> features,
                                   std::span<const model::OutputSpec> outputs,
                                   std::span<const record::Recording* const> recordings,
                                   double row_period_s, const RowChoice& choice = {});

/// What is trained on has at least so many rows: half a second of a recording at 100 Hz.
inline constexpr Eigen::Index kFewestRows = 50;

/// kData where `rows` are too few to train on, or no more than `inputs`, so that any error could be
/// matched. `what` stands before the sentence.
core::Status check_row_count(const std::string& what, Eigen::Index rows, Eigen::Index inputs);

/// Mean and standard deviation (population, as scikit-learn's StandardScaler) of each column. A
/// column that is constant, or varies less than single precision resolves, keeps scale 1 and is
/// listed in `constant`.
struct Scaling {
  model::Standardiser standardiser;
  std::vector<Eigen::Index> constant;
};
Scaling fit_scaling(const Eigen::Ref<const Eigen::MatrixXd>& values);
Scaling fit_scaling(const model::FeatureMatrix& values);

/// Sets scaling, range and trust region of the model's inputs to those of training rows
/// `inputs` [rows x features], SI units. Returns the columns that are constant.
std::vector<Eigen::Index> fit_inputs(const model::FeatureMatrix& inputs,
                                     model::CalibrationModel& model);

}  // namespace ravencal::learn
