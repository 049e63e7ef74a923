// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "model/calibration_model.hpp"

namespace ravencal::rezero {

/// What a hard stop, a pin or an external reading says of one joint, SI.
struct KnownJoint {
  std::string joint;
  double value = 0.0;
  double uncertainty = 0.0;  ///< one standard deviation, >= 0
};

/// A joint and a length or an angle of it, SI.
struct JointValue {
  std::string joint;
  double value = 0.0;
};

/// "shoulder=30deg+-0.1deg" (or with ±) each, of joints that the model corrects. Errors (kUsage):
/// another text, joint or unit; a joint twice; no uncertainty.
core::Result<std::vector<KnownJoint>> parse_pose(std::span<const std::string> texts,
                                                 const model::CalibrationModel& model);

/// "elbow=1.5deg" each, > 0; the same rules.
core::Result<std::vector<JointValue>> parse_bounds(std::span<const std::string> texts,
                                                   const model::CalibrationModel& model);

}  // namespace ravencal::rezero
