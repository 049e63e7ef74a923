// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "core/result.hpp"
#include "study/findings.hpp"
#include "study/results.hpp"
#include "study/table.hpp"

namespace ravencal::study {

/// Writes what a study found, `tables` (ablation_tables()) among it, to `folder`: report.html
/// (opens offline), tables.csv, tables.md, tables.tex and findings.json, each whole. The bytes
/// depend on the results only. Errors: kIo.
core::Status write_ablation_report(const Plan& plan, const Results& results,
                                   const std::vector<Table>& tables,
                                   const std::vector<Finding>& findings,
                                   const std::filesystem::path& folder);

}  // namespace ravencal::study
