// SPDX-License-Identifier: Apache-2.0
//
// Margins of a model with a plant's servo, for `train` and `convert`.
#pragma once

#include <string>
#include <vector>

#include "core/result.hpp"
#include "loop/margins.hpp"
#include "model/calibration_model.hpp"
#include "record/recording.hpp"

namespace ravencal::commands {

/// Smallest margins over rows of these recordings. Errors: the plant cannot be read or lacks a
/// servo or cable; its arm is not the model's; a recording lacks channels.
core::Result<loop::Margins> margins_with(const std::string& plant_file,
                                         const model::CalibrationModel& model,
                                         const std::vector<record::Recording>& recordings);

}  // namespace ravencal::commands
