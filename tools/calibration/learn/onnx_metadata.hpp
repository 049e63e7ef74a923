// SPDX-License-Identifier: Apache-2.0
//
// The part of a model that an ONNX graph cannot say, as key and JSON value.
#pragma once

#include <map>
#include <string>

#include "core/result.hpp"
#include "model/calibration_model.hpp"

namespace ravencal::learn {

using Metadata = std::map<std::string, std::string>;

Metadata metadata_of(const model::CalibrationModel& model);

/// Everything but the layers. Errors (kData): a key is missing or wrong; sizes disagree.
core::Result<model::CalibrationModel> model_from_metadata(const Metadata& metadata);

}  // namespace ravencal::learn
