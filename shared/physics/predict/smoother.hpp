// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "physics/motion.hpp"

namespace ravencal::physics {

/// Values that are not finite on the line between their neighbours; at an end as the next one.
Eigen::VectorXd without_gaps(const Eigen::VectorXd& values);

/// Position with its derivatives, from a recorded position by local cubic least squares over a
/// window (Savitzky and Golay, Anal. Chem. 1964, for uneven stamps). Zero phase, so that a
/// regressor is aligned with the sample it belongs to.
///
/// `fresh[i]` starts a new stretch: no window reaches across. NaN positions are bridged linearly.
/// Velocities: over the shortest window of 5 ms to 1.3 s (and at least 7 samples) whose noise in
/// them stays below 1 % of them. Accelerations: the same for theirs, and then on as far as the
/// motion keeps 95 % of them: all of its band and little above it. What friction makes of
/// velocities is not linear, so that it must be computed before any filter of efforts.
Motion smooth_motion(const Eigen::VectorXd& t_s, const Eigen::VectorXd& position,
                     const std::vector<char>& fresh);

}  // namespace ravencal::physics
