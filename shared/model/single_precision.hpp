// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "model/calibration_model.hpp"

namespace ravencal::model {

/// What the real-time plugin computes, in its precision and with its clamping of inputs
/// (scaled_inputs.hpp) and rounding of inputs (DenseLayer::input_step), for a model of any size.
/// `features_si` is [features x samples]; the result is [outputs x samples], SI units. The
/// reference for self-tests and for `convert --check`.
Eigen::MatrixXf predict_single(const CalibrationModel& model, const Eigen::MatrixXf& features_si);

}  // namespace ravencal::model
