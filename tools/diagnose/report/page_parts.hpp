// SPDX-License-Identifier: Apache-2.0
//
// Parts of report.html, in the order of the page. All they say stands in report.json.
#pragma once

#include <string>
#include <vector>

#include "diagnose/findings/findings.hpp"
#include "diagnose/report/causes.hpp"
#include "report/document.hpp"

namespace ravencal::diagnose {

/// A table row of cells that are HTML already.
std::string row_html(const std::vector<std::string>& cells, bool header = false);
/// A table; nothing without rows.
std::string table_html(const std::vector<std::string>& header, const std::string& rows);
/// "2 deg to 0.3 deg", red where it is worse.
std::string change_html(double before, double after, const std::string& unit);

/// A probability; a floor has none.
std::string chance_text(double p_value);

/// Sentence and chain of each joint, the change on unseen motion, one trace of it.
void add_first_screen(const Report& report, report::Document& page);
/// A card for each cause.
void add_causes(const Report& report, report::Document& page);
/// Recordings, channels, and what these do not show.
void add_looked_at(const Report& report, report::Document& page);
/// All the rest, folded.
void add_details(const Report& report, report::Document& page);

/// A trace of what that channel recorded and what the plant simulates.
std::string trace_html(const Report& report, const ChannelPlot& plot, const Trace& trace,
                       report::Document& page);
/// "q5, transmission".
template <typename T>
std::string place_of(const T& finding) {
  return finding.joint + ", " + finding.stage;
}

}  // namespace ravencal::diagnose
