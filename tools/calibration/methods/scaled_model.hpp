// SPDX-License-Identifier: Apache-2.0
//
// The frame of a CalibrationModel around layers: features, scaling, trained ranges, outputs.
#pragma once

#include <vector>

#include "methods/problem.hpp"
#include "model/calibration_model.hpp"

namespace ravencal::methods {

/// Everything but the layers, for the inputs in `columns` of the problem, fitted to `data`.
model::CalibrationModel frame_of(const Problem& problem, const std::vector<Eigen::Index>& columns,
                                 const Stack& data);

/// The first `count` columns.
std::vector<Eigen::Index> first_columns(Eigen::Index count);

/// Inputs and errors of `data` in the frame's scaling: [inputs x rows], [outputs x rows].
Eigen::MatrixXd scaled_inputs(const model::CalibrationModel& frame, const Stack& data);
Eigen::MatrixXd scaled_errors(const model::CalibrationModel& frame, const Stack& data);

}  // namespace ravencal::methods
