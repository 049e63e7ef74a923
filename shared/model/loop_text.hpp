// SPDX-License-Identifier: Apache-2.0
//
// What is known of the loop that a model closes, for people and for programs.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "model/calibration_model.hpp"

namespace ravencal::model {

/// Lines: the largest gains by output and group in degrees or millimetres per spread of an input,
/// and the steepest channel of each output.
std::string loop_text(const CalibrationModel& model);
/// A line with the margins; empty if unknown.
std::string margins_text(const CalibrationModel& model);

/// The same in SI units; null if unknown. An infinite gain margin is null.
nlohmann::ordered_json loop_json(const CalibrationModel& model);

}  // namespace ravencal::model
