// SPDX-License-Identifier: Apache-2.0
//
// The files of tools/report/page and Vega, built into the library by assets.S so that a report
// needs nothing that is installed.
#pragma once

#include <string_view>

extern "C" {
// Names of the assembler (assets.S). NOLINTBEGIN(readability-identifier-naming)
extern const char ravencal_report_html[], ravencal_report_html_end[];
extern const char ravencal_report_css[], ravencal_report_css_end[];
extern const char ravencal_report_js[], ravencal_report_js_end[];
extern const char ravencal_report_draw[], ravencal_report_draw_end[];
extern const char ravencal_report_licences[], ravencal_report_licences_end[];
extern const char ravencal_report_vega[], ravencal_report_vega_end[];
}

namespace ravencal::report::assets {

inline std::string_view between(const char* begin, const char* end) {
  return {begin, static_cast<std::size_t>(end - begin)};
}

inline std::string_view html() { return between(ravencal_report_html, ravencal_report_html_end); }
inline std::string_view css() { return between(ravencal_report_css, ravencal_report_css_end); }
inline std::string_view js() { return between(ravencal_report_js, ravencal_report_js_end); }
inline std::string_view draw() { return between(ravencal_report_draw, ravencal_report_draw_end); }
inline std::string_view vega() { return between(ravencal_report_vega, ravencal_report_vega_end); }
// NOLINTEND(readability-identifier-naming)
inline std::string_view licences() {
  return between(ravencal_report_licences, ravencal_report_licences_end);
}

}  // namespace ravencal::report::assets
