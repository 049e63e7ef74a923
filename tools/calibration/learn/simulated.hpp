// SPDX-License-Identifier: Apache-2.0
//
// A network that learns a simulation of the arm before it learns recordings. The result is one
// network of the usual layers, which is stored, converted and run as any other.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "learn/dataset.hpp"
#include "model/calibration_model.hpp"

namespace ravencal::learn {

/// Rows of both, `first` first; the counts of left-out rows are those of `first`.
Dataset joined(const Dataset& first, const Dataset& second);

/// The errors that `base` leaves.
Dataset left_by(const model::CalibrationModel& base, const Dataset& data);

/// The same network with its outputs in units of `to` in place of those of `from`.
std::vector<model::DenseLayer> in_units_of(const model::Standardiser& to,
                                           const model::Standardiser& from,
                                           std::vector<model::DenseLayer> layers);

/// Layers whose output is that of `first` plus that of `second`. The same number of layers in both;
/// hidden layers come side by side.
std::vector<model::DenseLayer> sum_of(const std::vector<model::DenseLayer>& first,
                                      const std::vector<model::DenseLayer>& second);

}  // namespace ravencal::learn
