// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/json.hpp"
#include "diagnose/report/write_report.hpp"
#include "report/document.hpp"

extern "C" {
// Names of the assembler (page.S). NOLINTNEXTLINE(readability-identifier-naming)
extern const char ravencal_diagnose_page[], ravencal_diagnose_page_end[];
}

namespace ravencal::diagnose {

std::string report_html(const Report& report) {
  const std::string data =
      report_document(report).dump(-1, ' ', false, Json::error_handler_t::replace);
  return report::drawn_html("Diagnosis of the simulation", data, "report.json",
                            {ravencal_diagnose_page, ravencal_diagnose_page_end});
}

}  // namespace ravencal::diagnose
