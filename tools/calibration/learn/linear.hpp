// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "model/calibration_model.hpp"

namespace ravencal::learn {

/// Least squares of `targets` [rows x outputs] on `inputs` [rows x features], both scaled, as one
/// linear layer: minimises the mean squared error plus, for each input, its `ridge` [features]
/// times its squared weights. Directions in which the inputs vary less than single precision
/// resolves get no weight (smallest-norm solution), so that features which repeat each other do not
/// blow up rounding. Exact, in double precision.
model::DenseLayer fit_linear(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& targets,
                             const Eigen::VectorXd& ridge);
/// The same ridge for all inputs.
model::DenseLayer fit_linear(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& targets,
                             double ridge);

}  // namespace ravencal::learn
