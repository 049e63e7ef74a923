// SPDX-License-Identifier: Apache-2.0
//
// The paper's findings as checks of a study's results: each holds, does not hold, or cannot be told
// from these results. No setting is tuned to make one hold.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "study/results.hpp"

namespace ravencal::study {

enum class Verdict {
  kHolds,        ///< the 95 % interval says so
  kDoesNotHold,  ///< the 95 % interval says the opposite, or the size is not there
  kUndecided,    ///< the interval contains both
  kNotTested     ///< the plan has no such rows
};
std::string_view name_of(Verdict verdict);

struct Finding {
  std::string id;
  std::string statement;  ///< the paper's, in words
  std::string condition;  ///< e.g. "unloaded"
  Verdict verdict = Verdict::kNotTested;
  std::string evidence;  ///< the figures, in words
};

std::vector<Finding> findings_of(const Results& results);

/// True if each finding that was tested holds.
bool all_hold(std::span<const Finding> findings);

/// Lines for a terminal.
std::string findings_text(std::span<const Finding> findings);
/// {"schema":1,"findings":[{"id","statement","condition","verdict","evidence"}]}
std::string findings_json(std::span<const Finding> findings);

}  // namespace ravencal::study
