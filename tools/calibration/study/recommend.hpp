// SPDX-License-Identifier: Apache-2.0
//
// Which model to load, given a comparison and what the user can afford.
#pragma once

#include <optional>
#include <string>

#include "core/result.hpp"
#include "study/compare_result.hpp"

namespace ravencal::study {

struct Constraints {
  double step_budget_us = 500.0;  ///< of one tick, at p99.9
  std::optional<double> minutes;  ///< of recording that the user will make; absent: as compared
};

struct Recommendation {
  std::string method;  ///< id
  std::string title;
  std::string model_file;  ///< below the comparison's folder
  double step_p999_us = 0.0;
  bool measured_in_loop = false;
  double minutes = 0.0;      ///< of training that the figures are of
  std::vector<double> rmse;  ///< per joint, display units, test recordings
  std::vector<std::string> joints;
  std::vector<std::string> units;
  std::vector<std::string> reasons;  ///< sentences, in order
};

/// The loadable method with the least error (geometric mean over joints) whose step keeps the
/// budget, judged by what it reached with no more training than the user will record. Where others
/// are as good within 2 %, the fastest of them. Errors (kData): no method qualifies; the sentence
/// says which constraint excludes which.
core::Result<Recommendation> recommend(const Comparison& comparison,
                                       const Constraints& constraints);

std::string recommendation_text(const Recommendation& recommendation, const std::string& folder);
std::string recommendation_json(const Recommendation& recommendation);

}  // namespace ravencal::study
