// SPDX-License-Identifier: Apache-2.0
//
// What a choice will do on other recordings, from what it did on rows that it did not see.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "model/expected_error.hpp"

namespace ravencal::choice {

/// `judged` [lists]: prediction - error of rows that neither fit nor choice saw, SI, at least one
/// list. The expected RMSE is that of equally many rows of every list. `session_constants`: those
/// of the sessions, SI; a new session has one of its own, whose spread is that of these. The RMSE
/// of a list is taken as log-normal and the constant as normal, each of unknown spread: 95 %
/// intervals of one more value are Student's.
model::ExpectedError expected_error(const std::vector<Eigen::VectorXd>& judged,
                                    const std::vector<double>& session_constants);

}  // namespace ravencal::choice
