// SPDX-License-Identifier: Apache-2.0
//
// The paper's tables from a study's results, with its own figures beside ours where it states them.
#pragma once

#include <string_view>
#include <vector>

#include "study/results.hpp"
#include "study/table.hpp"

namespace ravencal::study {

/// A rise of the RMSE that the paper marks: more than 30 %.
inline constexpr double kMarkedRatio = 1.3;

/// What a joint's column of peaks is called after its name.
inline constexpr std::string_view kPeakColumn = " peak";

/// The tables of the studies that the plan includes, in the paper's order; RMSE in deg and mm.
std::vector<Table> ablation_tables(const Plan& plan, const Results& results);

}  // namespace ravencal::study
