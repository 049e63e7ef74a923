// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "diagnose/model/likelihood.hpp"

namespace ravencal::diagnose {

/// Orders, rad per joint unit of the motor's angle and up to `highest`, at which waves stand out
/// of what the channel leaves (`left`: stacked innovations); the strongest first, few of them.
std::vector<double> orders_in(const Likelihood& likelihood, const Channel& channel,
                              const Eigen::VectorXd& left, double highest);

}  // namespace ravencal::diagnose
