// SPDX-License-Identifier: Apache-2.0
//
// A recording as the plugin would have seen it. Rows are published states: positions, torques and
// poses of one control cycle. At the plugin's hook, before the control law, the positions are those
// of this cycle, but torque, DAC, desired values and pose are still those of the cycle before
// (core::is_cycle_old_at_hook). Not real time.
#pragma once

#include "core/result.hpp"
#include "model/calibration_model.hpp"
#include "model/feature_matrix.hpp"
#include "record/recording.hpp"

namespace ravencal::model {

/// RAVEN-II's control period.
inline constexpr double kControlCycleS = 1e-3;

/// Puts every channel that is one cycle old at the hook back by a control cycle. Exact where rows
/// are one cycle apart; between rows that are farther apart on the straight line between them. NaN
/// where no row came shortly before: in the first row, after gaps of ten rows and at events of kind
/// "episode".
record::Recording as_seen_at_hook(record::Recording recording);

/// Whether the model was trained on recordings so changed.
bool is_trained_at_hook(const CalibrationModel& model);
void set_trained_at_hook(CalibrationModel& model);

/// Inputs of every row as this model was trained to see them; errors as of feature_matrix.
core::Result<FeatureMatrix> inputs_of(const CalibrationModel& model,
                                      const record::Recording& recording);

}  // namespace ravencal::model
