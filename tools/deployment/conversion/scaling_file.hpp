// SPDX-License-Identifier: Apache-2.0
//
// Facts that the file of another program's network lacks, from a JSON or npz file beside it: which
// inputs and outputs it has, in which units, and how they were scaled. shared/FORMATS.md lists the
// keys.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "model/calibration_model.hpp"

namespace ravencal::conversion {

/// (value - mean) / scale, in the file's units.
struct FileScaling {
  Eigen::VectorXd mean;
  Eigen::VectorXd scale;  ///< not 0
};

struct ScalingFile {
  std::vector<model::FeatureSpec> features;
  Eigen::VectorXd feature_to_si;  ///< [features]: value_si = value * to_si, > 0
  std::optional<FileScaling> input;
  std::optional<FileScaling> output;
  Eigen::VectorXd input_min;  ///< trained range in the file's units, or empty
  Eigen::VectorXd input_max;
  std::vector<model::OutputSpec> outputs;  ///< in SI units
  Eigen::VectorXd output_to_si;
  model::Arm arm = model::Arm::kUnknown;  ///< whose columns are meant
  double row_period_s = 0.01;
  std::uint32_t window = 0;  ///< GRU: samples; 0: not given
  std::uint32_t stride_rows = 1;
};

/// Reads `path`, JSON or (.npz) NumPy. Errors (kIo, kData) name the key and the remedy; unknown
/// keys are errors.
core::Result<ScalingFile> read_scaling_file(const std::string& path);

}  // namespace ravencal::conversion
