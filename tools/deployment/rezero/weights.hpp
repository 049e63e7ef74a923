// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "core/result.hpp"
#include "model/calibration_model.hpp"

namespace ravencal::rezero {

struct Weights {
  model::CalibrationModel model;
  std::uint32_t checksum = 0;  ///< ravencal_info.checksum
};

/// Errors: those of model::read_blob.
core::Result<Weights> load_weights(const std::filesystem::path& path);

}  // namespace ravencal::rezero
