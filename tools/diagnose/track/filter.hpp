// SPDX-License-Identifier: Apache-2.0
//
// The one filter through which predictions and measurements are compared: a triangle of weights
// ("tent") over +-kTentS, two passes of a moving mean. It keeps what lies below some 5 Hz: above,
// the motion follows the disturbances (closed loop) and the quanta of the encoders, and would bias
// what is found of the dynamics.
#pragma once

#include <Eigen/Core>

namespace ravencal::diagnose {

inline constexpr double kTentS = 0.1;

/// `half_width` in rows; below 2 nothing is filtered.
Eigen::VectorXd tent(const Eigen::VectorXd& x, Eigen::Index half_width);

/// Central first and second differences per period; zero at both ends. Under the tent the second
/// one is the acceleration at any rate, since both are linear.
Eigen::VectorXd first_difference(const Eigen::VectorXd& x, double period_s);
Eigen::VectorXd second_difference(const Eigen::VectorXd& x, double period_s);

}  // namespace ravencal::diagnose
