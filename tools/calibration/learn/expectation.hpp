// SPDX-License-Identifier: Apache-2.0
//
// What training expected of a model beside what came.
#pragma once

#include <string>

#include "learn/evaluate.hpp"

namespace ravencal::learn {

/// A table: per joint the expected RMSE with its 95 % interval, and with each recording's mean
/// error taken off; with `came` beside what the evaluation found. Empty for models without an
/// expectation.
std::string expectation_table(const Evaluation& evaluation, bool came);

}  // namespace ravencal::learn
