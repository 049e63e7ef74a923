// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace ravencal::physics {

/// Motion of a joint or of its motor, one value per row: rad or m, and per s. smooth_motion() makes
/// it of a recorded position.
struct Motion {
  Eigen::VectorXd q;   ///< as recorded: operators with memory need its true extremes
  Eigen::VectorXd v;   ///< over the shortest window that its noise allows
  Eigen::VectorXd a;   ///< over a window of its own
  double noise = 0.0;  ///< standard deviation of the position about its local cubic
};

}  // namespace ravencal::physics
