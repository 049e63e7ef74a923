// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

namespace ravencal::diagnose {

/// Position with its derivatives, from a recorded position by local cubic least squares over
/// +-half_width_s (Savitzky and Golay, Anal. Chem. 1964, for uneven stamps). Zero phase, so that a
/// regressor is aligned with the sample it belongs to.
struct Motion {
  Eigen::VectorXd q;
  Eigen::VectorXd v;
  Eigen::VectorXd a;
  double half_width_s = 0.0;
  double noise = 0.0;  ///< standard deviation of the position about its local cubic
};

/// `fresh[i]` starts a new stretch: no window reaches across. NaN positions are bridged linearly.
/// The window is the shortest of 5 ms to 1.3 s (and at least 7 samples) whose acceleration noise
/// stays below 5 % of the acceleration itself.
Motion smooth_motion(const Eigen::VectorXd& t_s, const Eigen::VectorXd& position,
                     const std::vector<char>& fresh);

}  // namespace ravencal::diagnose
