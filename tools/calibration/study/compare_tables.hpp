// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "study/compare_result.hpp"
#include "study/table.hpp"

namespace ravencal::study {

/// Errors, cost, robustness (where sets were given), learning curves and the verdict per joint.
std::vector<Table> comparison_tables(const Comparison& comparison);

/// One or two sentences: where the best of ours beats every rival and where it does not.
std::string verdict_text(const Comparison& comparison);

/// Whether the method fits the loop's budget, in a few words.
std::string loop_words(const MethodResult& method, double budget_us);

}  // namespace ravencal::study
