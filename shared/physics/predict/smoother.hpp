// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "physics/motion.hpp"

namespace ravencal::physics {

/// Values that are not finite on the line between their neighbours; at an end as the next one.
Eigen::VectorXd without_gaps(const Eigen::VectorXd& values);

/// Filters `y` with the kernel that the acceleration of smooth_motion() has been through: the
/// second derivative of a local parabola is the true one under the weights (1 - u^2)^2, u = t /
/// half_width. An effort so filtered can be compared with mass times acceleration at sharp edges
/// too (parallel filtering of Gautier's inverse dynamic identification).
Eigen::VectorXd filter_like_acceleration(const Eigen::VectorXd& t_s, const Eigen::VectorXd& y,
                                         const std::vector<char>& fresh, double half_width_s);

/// Position with its derivatives, from a recorded position by local cubic least squares over a
/// window (Savitzky and Golay, Anal. Chem. 1964, for uneven stamps). Zero phase, so that a
/// regressor is aligned with the sample it belongs to.
///
/// `fresh[i]` starts a new stretch: no window reaches across. NaN positions are bridged linearly.
/// The window is chosen on the rows that are not in `unseen`: from the shortest of 5 ms to 1.3 s
/// (and at least 7 samples) whose noise in the derivative of order `need` (1 or 2) stays below 1 %
/// of that derivative; for accelerations then on, as far as the motion keeps 95 % of them: all of
/// the motion's band and little above it. Velocities keep their own, shorter window: what friction
/// makes of them is not linear, so that it must be computed before any filter of efforts.
Motion smooth_motion(const Eigen::VectorXd& t_s, const Eigen::VectorXd& position,
                     const std::vector<char>& fresh, const std::vector<char>& unseen, int need);

}  // namespace ravencal::physics
