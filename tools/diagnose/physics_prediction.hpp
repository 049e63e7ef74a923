// SPDX-License-Identifier: Apache-2.0
//
// What a plant says about the error between truth and estimate at every row of a recording: the
// physics that a network then need not learn.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "physics/plant.hpp"
#include "record/recording.hpp"

namespace ravencal::diagnose {

struct PredictedError {
  std::string joint;
  std::string unit;       ///< rad or m
  Eigen::VectorXd error;  ///< truth - estimate, one per row
};

/// Errors of the joints that have an estimate and a truth channel; no value of the truth is used.
/// Errors (kData): fewer than 50 rows, or no such joint in the plant.
core::Result<std::vector<PredictedError>> predict_errors(const record::Recording& recording,
                                                         const physics::Plant& plant);

}  // namespace ravencal::diagnose
