// SPDX-License-Identifier: Apache-2.0
//
// Runs a model on the samples that its GRU looks at; a model without one looks at one sample. Where
// CalibrationModel::predict holds a row over the whole window, this takes each sample as it is.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "model/calibration_model.hpp"

namespace ravencal::conversion {

/// 1 without a GRU.
std::size_t window_of(const model::CalibrationModel& model);

/// Samples of the window, oldest first, each [rows x features] in SI units; the result, [rows x
/// outputs], is what double precision gives.
Eigen::MatrixXd predict_exact(const model::CalibrationModel& model,
                              std::span<const Eigen::MatrixXf> samples);

/// The same as the plugin computes it (model/single_precision.hpp): f32, inputs clamped, and where
/// the weights were int8 rounded.
Eigen::MatrixXd predict_packed(const model::CalibrationModel& weights,
                               std::span<const Eigen::MatrixXf> samples);

}  // namespace ravencal::conversion
