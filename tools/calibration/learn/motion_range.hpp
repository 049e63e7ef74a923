// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

#include "model/calibration_model.hpp"
#include "record/recording.hpp"

namespace ravencal::learn {

/// [rows x outputs], SI per second; NaN where unknown.
Eigen::MatrixXd joint_speeds(std::span<const model::OutputSpec> outputs,
                             const record::Recording& recording);
Eigen::MatrixXd joint_efforts(std::span<const model::OutputSpec> outputs,
                              const record::Recording& recording);

}  // namespace ravencal::learn
