// SPDX-License-Identifier: Apache-2.0
//
// A true effect keeps its size at all speeds, loads and directions; a proxy does not.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "diagnose/explain/circumstances.hpp"
#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// Factor of the contribution in each half of a circumstance, beside a free constant; a
/// circumstance in whose halves it cannot be seen has none. Two entries each, low and high.
/// `contribution`: what the effect adds to the prediction; `left`: of the error with it.
std::vector<RegimeScale> scales_of(const std::string& effect, const Eigen::VectorXd& contribution,
                                   const Eigen::VectorXd& left, const ChannelRows& at);

/// Largest difference between the factors of two halves.
double spread_of(const std::vector<RegimeScale>& scales);

}  // namespace ravencal::diagnose
