// SPDX-License-Identifier: Apache-2.0
//
// The project's network as a part of other methods, which put physics before it or a forest behind
// it.
#pragma once

#include "methods/method.hpp"

namespace ravencal::methods {

/// Trains settings.networks networks on the inputs of `data`, the first of the problem's, and
/// averages them. `done_from`, `done_to`: the part of the whole work that this is. Errors: stopped;
/// diverged.
core::Result<model::CalibrationModel> train_network(const Problem& problem, const Stack& data,
                                                    const Settings& settings, double penalty_scale,
                                                    double done_from, double done_to);

/// The same with the penalty scale that blocked validation on training data prefers, unless
/// settings say one. Small training sets only; else the paper's penalties.
core::Result<double> choose_penalty(const Problem& problem, std::span<const Series> train,
                                    Eigen::Index columns, const Settings& settings);

}  // namespace ravencal::methods
