// SPDX-License-Identifier: Apache-2.0
//
// What a diagnosis leaves behind: for programs, for people, for `ravencal simulate`.
#pragma once

#include <filesystem>
#include <string>

#include "core/result.hpp"
#include "diagnose/findings/findings.hpp"

namespace ravencal::diagnose {

/// report.json as text, schema 1.
std::string report_json(const Report& report);

/// report.html: one page that needs nothing else.
std::string report_html(const Report& report);

/// The improved plant as a file's text, which parse_plant reads if the plant that was diagnosed
/// could be read. Findings that no plant can hold stand in comments at its end.
std::string improved_text(const Report& report);

/// Writes report.json, report.html and plant_improved.toml into `folder`, which is made if absent,
/// each through a partial file. Errors: something cannot be written (kIo).
core::Status write_report(const Report& report, const std::filesystem::path& folder);

}  // namespace ravencal::diagnose
