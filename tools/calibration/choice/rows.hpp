// SPDX-License-Identifier: Apache-2.0
//
// What a choice among models is made on: inputs and joint errors of training rows, and the parts of
// the training that are held out in turn. SI units.
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
  /// Index of the homing that a row follows. Recordings without an event of kind "homing" share
  /// one.
  std::vector<int> homing;
  std::size_t without_truth = 0;  ///< left out: no joint's error is known
  std::size_t without_input = 0;  ///< left out: an input is lost
};

/// Rows of all recordings in order. Inputs are made from every row, also from those that are
/// thinned out. Errors (kData): a channel is missing, or an output has no row.
core::Result<Rows> make_rows(std::span<const model::FeatureSpec> features,
                             std::span<const model::OutputSpec> outputs,
                             std::span<const record::Recording* const> recordings,
                             double row_period_s);

/// Rows that are held out in turn; a model that predicts some is fitted to all others.
struct HeldOut {
  std::vector<std::vector<Eigen::Index>> rows;
  bool by_recording = false;
};

/// Whole recordings where there are enough of them, because a recording has its own homing, load
/// and speed; else stretches of time, because neighbours resemble each other. Last, the half of the
/// rows in which some position is farthest from the middle of its range: a robot moves beyond what
/// it was calibrated on, and a model that bends away there must lose against one that does not.
/// `recording` is that of each row; `positions` are [rows x joints]; without joints the last list
/// is empty.
HeldOut held_out_parts(std::span<const int> recording, const Eigen::MatrixXd& positions);

}  // namespace ravencal::choice
