// SPDX-License-Identifier: Apache-2.0
//
// Does the form of a case tell what it hides? A linear classifier on metadata and moments looks at
// recordings with nothing hidden and at ones whose effect vanishes (a thousandth of the floor): it
// must stay at chance.
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
  std::function<void(CaseFiles&)> planted;  ///< tests: gives away what hides something
};

/// {"pairs", "accuracy", "ci95", "at_chance"}; at chance: the interval holds one half. Without any
/// leak it does so for 95 % of the seeds. Generates, and diagnoses nothing.
core::Result<nlohmann::ordered_json> leak_test(const ProofOptions& options,
                                               const LeakOptions& leak = {});

}  // namespace ravencal::prove
