// SPDX-License-Identifier: Apache-2.0
//
// What a choice will do on other recordings, from what it did on rows that it did not see.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "model/expected_error.hpp"

namespace ravencal::choice {

/// `judged` [lists]: prediction - error of rows that neither fit nor choice saw, SI, at least one
/// list. The expected RMSE is that of equally many rows of every list. `homing_constants`: one for
/// each homing (sessions.hpp), SI; another homing has one of its own, whose spread is that of
/// these. The RMSE of a list is taken as log-normal and the constant as normal, each of unknown
/// spread: 95 % intervals of one more value are Student's. `left_to_chance`: by how much other
/// random units would move the prediction, standard deviation, SI.
model::ExpectedError expected_error(const std::vector<Eigen::VectorXd>& judged,
                                    const std::vector<double>& homing_constants,
                                    double left_to_chance = 0.0);

}  // namespace ravencal::choice
