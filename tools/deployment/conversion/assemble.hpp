// SPDX-License-Identifier: Apache-2.0
//
// Makes a calibration model in SI units from another program's network and its scaling file.
#pragma once

#include <string>

#include "conversion/foreign_model.hpp"
#include "conversion/scaling_file.hpp"
#include "core/result.hpp"
#include "model/calibration_model.hpp"
#include "model/feature_matrix.hpp"

namespace ravencal::conversion {

/// `training_rows` [rows x features], SI units, may have no row; from them come the trust region
/// and, where `scaling` does not give it, the trained range. Errors (kData): sizes that disagree, a
/// scaling that is given twice or not at all, no trained range, a window that is not known.
core::Result<model::CalibrationModel> assemble(const ForeignModel& source,
                                               const ScalingFile& scaling,
                                               const model::FeatureMatrix& training_rows);

}  // namespace ravencal::conversion
