// SPDX-License-Identifier: Apache-2.0
//
// Parameters that a recording fixes only together: one product of powers is known, each of them is
// not. From the eigenvectors of the covariance of bootstrap draws.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// `log_draws`: [draws][parameters], natural logarithms of positive values. Groups whose members
/// are each uncertain by more than 15 % while one combination of them is known five times as well.
std::vector<Combination> combinations_of(const std::vector<CombinedParameter>& parameters,
                                         const Eigen::MatrixXd& log_draws);

}  // namespace ravencal::diagnose
