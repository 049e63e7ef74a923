// SPDX-License-Identifier: Apache-2.0
//
// The report's tables as HTML.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "report/report.hpp"

namespace ravencal::report {

/// RMSE and peak per joint, raw, bias removed and calibrated, with the reductions between them.
std::string error_table_html(const ErrorTable& table);
/// Percentiles of wake-up and step in microseconds.
std::string duration_table_html(const RealTimeFigures& figures);
/// Two columns, name and value.
std::string facts_html(const std::vector<std::pair<std::string, std::string>>& facts);

/// Reduction of `after` against `before` as a text in %: "86.2 %", "−12.0 %" (it became worse), or
/// a dash when either is unknown or `before` is not positive.
std::string reduction_text(double before, double after);
/// A figure in fixed decimals or, if unknown, a dash.
std::string figure_text(double value, int decimals);
/// Decimals that show `least` (the smallest figure of a row) with three significant digits, 0 to 6.
int decimals_for(double least);

}  // namespace ravencal::report
