// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "model/calibration_model.hpp"

namespace ravencal::learn {

/// A model in words for a person, several lines.
std::string describe_in_words(const model::CalibrationModel& model);

/// The same for a program: {"layers", "row_period_s", "outputs", "features", "provenance"}, SI
/// units.
std::string describe_in_json(const model::CalibrationModel& model);

}  // namespace ravencal::learn
