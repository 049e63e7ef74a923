// SPDX-License-Identifier: Apache-2.0
//
// Compares converted weights with their source file on the same random inputs: an interpreter runs
// the file in double, and the weights run as in the plugin.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "conversion/foreign_model.hpp"
#include "conversion/scaling_file.hpp"
#include "core/result.hpp"
#include "model/calibration_model.hpp"

namespace ravencal::conversion {

struct SourceDifference {
  std::string joint;
  std::string unit;
  double largest = 0.0;    ///< SI units
  double spread = 0.0;     ///< standard deviation of the file's own outputs, SI units
  double magnitude = 0.0;  ///< largest of the file's own outputs, SI units

  /// Whether no more than the rounding of single precision lies between the two: about 1e-6 of the
  /// spread in a wide network, and 6e-8 of the value itself; a wrong weight shows at once.
  [[nodiscard]] bool is_rounding() const { return largest <= 1e-4 * spread + 1e-6 * magnitude; }
};

struct SourceCheck {
  std::size_t rows = 0;
  std::size_t samples = 1;  ///< of a window
  std::vector<SourceDifference> joints;
};

/// `kept_inputs` are the features that `weights` still has. Inputs are uniform within the trained
/// range of `model`; the same seed gives the same rows. Errors (kData): the file cannot be run.
core::Result<SourceCheck> check_source(const ForeignModel& source, const ScalingFile& scaling,
                                       const model::CalibrationModel& model,
                                       const model::CalibrationModel& weights,
                                       const std::vector<std::size_t>& kept_inputs);

}  // namespace ravencal::conversion
