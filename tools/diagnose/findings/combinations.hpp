// SPDX-License-Identifier: Apache-2.0
//
// Parameters that a recording fixes only together: one product of powers is known, each of them is
// not. From the eigenvectors of their covariance.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// The parameters whose product is known five times as well as each of them, which are all
/// uncertain by more than 15 %; none without such. `logs`: natural logarithms of positive values,
/// [parameters]; `covariance`: theirs.
std::optional<Combination> combination_of(const std::vector<CombinedParameter>& parameters,
                                          const Eigen::VectorXd& logs,
                                          const Eigen::MatrixXd& covariance);

}  // namespace ravencal::diagnose
