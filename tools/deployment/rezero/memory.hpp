// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "model/calibration_model.hpp"
#include "record/recording.hpp"

namespace ravencal::rezero {

/// Inputs whose memory is still that of the start at `row`: a play that has not been pushed from
/// one end to the other, a mean that began less than three of its lengths ago. What the weights
/// predict with them says more of the start than of the robot. Text forms of the features.
std::vector<std::string> unsettled_inputs(const model::CalibrationModel& model,
                                          const record::Recording& recording, Eigen::Index row);

}  // namespace ravencal::rezero
