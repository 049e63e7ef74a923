// SPDX-License-Identifier: Apache-2.0
//
// Does the form of a case tell what it hides? A linear classifier on metadata and moments looks at
// recordings with nothing hidden and at ones whose effect vanishes (a thousandth of the floor): it
// must stay at chance.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "prove/proof.hpp"
#include "prove/statistics.hpp"

namespace ravencal::prove {

/// Cases the classifier gets right when it has seen all others; `features[i]` belong to
/// `labels[i]`. Regularised least squares on the ranks of each feature, predicted for each left-out
/// pair of one of either label, so that a constant guess scores exactly one half.
Share classifier_hits(const std::vector<std::vector<double>>& features,
                      const std::vector<int>& labels);

/// {"pairs", "accuracy", "ci95", "at_chance"}; at chance: the interval holds one half.
core::Result<nlohmann::ordered_json> leak_test(const ProofOptions& options, int pairs = 60,
                                               double duration_s = 20.0);

}  // namespace ravencal::prove
