// SPDX-License-Identifier: Apache-2.0
//
// What homings left behind in the training: each finds zeros of its own, so that each session has a
// constant error beside the one that the model corrects. Their spread says how large the constant
// of a session that nobody has seen can be. Kept in the model's provenance, and so in ONNX files
// and weights alike.
#pragma once

#include <string>
#include <vector>

#include "core/result.hpp"
#include "model/calibration_model.hpp"

namespace ravencal::model {

/// Of one output, SI.
struct HomingConstants {
  std::string joint;
  std::vector<double> constants;  ///< of the homings, rising
  double rmse_about_mean = 0.0;   ///< expected RMSE of a recording with its mean error taken off
};

/// Keeps them with the model, in place of those before.
void keep_homing_constants(CalibrationModel& model, const std::vector<HomingConstants>& constants);

/// Those of the model, empty where it does not know any. Errors (kData): it holds something else
/// under their name.
core::Result<std::vector<HomingConstants>> homing_constants_of(const CalibrationModel& model);

}  // namespace ravencal::model
