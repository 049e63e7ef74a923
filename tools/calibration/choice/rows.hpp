// SPDX-License-Identifier: Apache-2.0
//
// What a choice among models is made on: inputs, joint errors and motion of training rows. SI
// units.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "core/result.hpp"
#include "model/calibration_model.hpp"
#include "model/feature_matrix.hpp"
#include "record/recording.hpp"

namespace ravencal::choice {

/// Training rows beyond this number are thinned evenly: neighbours in time say the same.
inline constexpr Eigen::Index kMostRows = 20000;

struct Rows {
  model::FeatureMatrix inputs;  ///< [rows x features], all finite
  Eigen::MatrixXd errors;       ///< truth - estimate, [rows x outputs]; NaN where unknown
  std::vector<int> recording;   ///< index of the recording that a row is from
  /// Index of the session of a row: what follows one homing (events "homing" and "rehoming").
  /// Recordings without such an event share one.
  std::vector<int> session;
  std::vector<int> own_session;   ///< the same, but each recording without an event is a session
  Eigen::MatrixXd speeds;         ///< [rows x outputs], >= 0; NaN where unknown
  Eigen::MatrixXd efforts;        ///< [rows x outputs], >= 0; NaN where unknown
  Eigen::MatrixXd loads;          ///< of sensors behind the cables, likewise
  std::size_t without_truth = 0;  ///< left out: no joint's error is known
  std::size_t without_input = 0;  ///< left out: an input is lost
};

/// Rows of all recordings in order. Errors (kData): a channel is missing, or an output has no row.
core::Result<Rows> make_rows(std::span<const model::FeatureSpec> features,
                             std::span<const model::OutputSpec> outputs,
                             std::span<const record::Recording* const> recordings,
                             double row_period_s);

}  // namespace ravencal::choice
