// SPDX-License-Identifier: Apache-2.0
//
// Puts a report together as one HTML document.
#pragma once

#include <string>

#include "report/report.hpp"

namespace ravencal::report {

/// The whole page. `report` must be consistent (write_html() checks that first).
std::string page_of(const CalibrationReport& report);

}  // namespace ravencal::report
