// SPDX-License-Identifier: Apache-2.0
//
// Derivatives of a model's outputs with respect to its inputs, and the gains of the loop that some
// of these inputs close through the correction (model/loop_group.hpp).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "model/calibration_model.hpp"
#include "model/feature_matrix.hpp"

namespace ravencal::model {

/// d output / d feature of every row: [rows] matrices of [outputs x features], SI unit of the
/// output per SI unit of the feature. Dense layers: exact, the chain rule in double precision from
/// the output back to the scaled input. At the kink of relu, and by an input that is clamped
/// (scaled_inputs.hpp), the derivative is 0. A GRU sees each
/// row held over its window (as CalibrationModel::predict): central differences of that, steps of
/// 1e-4 of the input's scale, so that the derivative is the sum over the window.
std::vector<Eigen::MatrixXd> jacobians(const CalibrationModel& model, const FeatureMatrix& rows_si);

/// Indices of the features whose channel answers to the motor command. Empty: no loop is closed.
std::vector<std::size_t> answering_features(const CalibrationModel& model);

/// At most `count` rows, evenly drawn, the first among them.
FeatureMatrix evenly_drawn(const FeatureMatrix& rows, Eigen::Index count);

/// Rows of which loop_gains looks at most: a quarter of a second's work for the light network, some
/// seconds for the paper's.
inline constexpr Eigen::Index kLoopGainRows = 4096;

/// Largest gains over the rows, of which at most kLoopGainRows are looked at, evenly drawn. All
/// features of one channel (value, lags, plays, means) are added up by size: an upper bound at
/// every frequency. The gain of a play operator or mean is counted as 1, its largest. Without rows
/// or without features that answer: no channels and zeros.
LoopGains loop_gains(const CalibrationModel& model, const FeatureMatrix& rows_si);

}  // namespace ravencal::model
