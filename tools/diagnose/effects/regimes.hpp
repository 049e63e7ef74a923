// SPDX-License-Identifier: Apache-2.0
//
// The circumstances under which a residual is looked at: what the remainder learner sees, what the
// where-map cuts by, and what a parameter must not depend on.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "diagnose/series/series.hpp"

namespace ravencal::diagnose {

struct RegimeOf {
  std::string
      name;  ///< "position", "direction", "speed", "load", "since_reversal", "position of q5"
  std::string unit;
  Eigen::VectorXd value;  ///< [rows]
};

/// Everything but time: position, direction, speed, loads, memory, the other joints.
std::vector<RegimeOf> circumstances(const Series& series);

}  // namespace ravencal::diagnose
