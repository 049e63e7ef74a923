// SPDX-License-Identifier: Apache-2.0
//
// The loop that a model closes through its inputs: gains, margins, and what is refused.
#pragma once

#include "conversion/convert.hpp"
#include "core/result.hpp"
#include "model/feature_matrix.hpp"

namespace ravencal::conversion {

/// Computes gains and, with a plant, margins of the loop that the model closes, into the model that
/// becomes the weights. Errors (kUsage): it closes one, and neither training nor recordings tell
/// its gains, unless the request accepts an unbounded loop.
core::Status bound_loop(const Request& request, Outcome& outcome);

/// Appends the rows without a lost value.
void append_whole_rows(const model::FeatureMatrix& more, model::FeatureMatrix& rows);

}  // namespace ravencal::conversion
