// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <string>
#include <vector>

namespace ravencal::model {

/// An unknown range holds everything.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};

/// What the training showed of one output's joint: the 1st and 99th percentile over its rows, SI.
struct JointMotion {
  Range speed;               ///< of the estimate, signed, rad/s or m/s
  std::string load_channel;  ///< of the joint's effort; empty: none
  Range load;                ///< of that channel, in its unit
};

/// One per output.
using MotionRange = std::vector<JointMotion>;

}  // namespace ravencal::model
