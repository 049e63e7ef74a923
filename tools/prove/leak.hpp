// SPDX-License-Identifier: Apache-2.0
//
// Tests whether the form of a case reveals its content. A linear classifier on metadata and moments
// compares recordings without an effect with recordings whose effect is negligible (a thousandth of
// the floor). Its accuracy must be that of chance.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "prove/generator/case.hpp"
#include "prove/proof.hpp"
#include "prove/statistics.hpp"

namespace ravencal::prove {

/// Cases the classifier gets right when it has seen all others; `features[i]` belong to
/// `labels[i]`. Regularised least squares on the ranks of each feature, predicted for each left-out
/// pair of one of either label, so that a constant guess scores exactly one half.
Share classifier_hits(const std::vector<std::vector<double>>& features,
                      const std::vector<int>& labels);

struct LeakOptions {
  int pairs = 200;  ///< recordings of either kind
  double duration_s = 20.0;
  std::function<void(CaseFiles&)> planted;  ///< tests: marks the cases that conceal an effect
};

/// {"pairs", "accuracy", "ci95", "at_chance"}; at chance: the interval holds one half, which
/// without a leak is so for 95 % of the seeds. Generates cases and diagnoses none.
core::Result<nlohmann::ordered_json> leak_test(const ProofOptions& options,
                                               const LeakOptions& leak = {});

}  // namespace ravencal::prove
