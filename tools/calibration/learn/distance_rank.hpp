// SPDX-License-Identifier: Apache-2.0
//
// Whether the distance of the inputs from the training tells where a model errs.
#pragma once

#include "learn/evaluate.hpp"

namespace ravencal::learn {

/// Spearman's rank correlation, over stretches of 1 s, of the mean distance
/// (model/trust_region.hpp) with the RMSE after the correction, in -1 .. 1. NaN for fewer than
/// three stretches, or where distances are unknown or all alike.
double distance_rank(const JointEvaluation& joint);

}  // namespace ravencal::learn
