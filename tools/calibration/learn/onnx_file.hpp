// SPDX-License-Identifier: Apache-2.0
//
// Calibration models as ONNX files (opset 13) that any runtime can open: input `features` [N, n] in
// raw SI units, output `joint_error` [N, m] in SI units, scaling inside the graph. What a graph
// cannot say (feature list, exact scaling, trained ranges, outputs, provenance) is in its metadata;
// shared/FORMATS.md lists the keys.
#pragma once

#include <filesystem>
#include <string>

#include "core/result.hpp"
#include "model/calibration_model.hpp"

namespace ravencal::learn {

/// Errors: kIo; then `path` is as it was.
core::Status write_onnx(const model::CalibrationModel& model, const std::filesystem::path& path);

/// Whether the file says of itself that ravencal wrote it. Errors: kIo; kData: no ONNX file.
core::Result<bool> is_ravencal_onnx(const std::filesystem::path& path);

/// Reads what write_onnx writes; everything is checked, and what does not fit is named.
/// Errors: kIo, kData.
core::Result<model::CalibrationModel> read_onnx(const std::filesystem::path& path);

}  // namespace ravencal::learn
