// SPDX-License-Identifier: Apache-2.0
//
// What the kernels of every instruction set compute, and how far from it they may be. The kernels
// state these errors, their tests measure them, and the tolerance of a blob's self-test follows
// from them. Unit roundoff, accumulated roundings: N. Higham, Accuracy and Stability of Numerical
// Algorithms, 2nd ed., chapter 3.
#pragma once

#include <Eigen/Core>

#include "model/calibration_model.hpp"

namespace ravencal::model {

/// Largest error of an activation, whatever its (float) argument: measured over all of
/// them, 2.28e-7 and 4.11e-7 without fused multiplication, 1.70e-7 and 2.92e-7 with it.
inline constexpr double kSigmoidError = 2.3e-7;
inline constexpr double kTanhError = 4.2e-7;

/// Most roundings on the way of one product through the sum of a layer's output.
[[nodiscard]] Eigen::Index roundings_of_sum(const DenseLayer& layer);

struct KernelPromise {
  Eigen::MatrixXd outputs;  ///< [outputs x samples], SI units
  Eigen::MatrixXd error;    ///< no kernel is farther from `outputs`; SI units
};

/// For a model with the weights that the kernels read (unpack_layers). In double precision; inputs
/// of int8 layers are rounded as the kernels round them. `features_si` [features x samples] lie
/// within the range to which the plugin clamps.
[[nodiscard]] KernelPromise kernel_promise(const CalibrationModel& model,
                                           const Eigen::MatrixXf& features_si);

}  // namespace ravencal::model
