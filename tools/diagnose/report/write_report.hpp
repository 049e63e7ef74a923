// SPDX-License-Identifier: Apache-2.0
//
// What a diagnosis leaves behind: for programs, for people, for `ravencal simulate`.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

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

/// Texts of files, by their names.
using Texts = std::map<std::string, std::string>;

/// Writes report.json, report.html and plant_improved.toml into `folder`, which is made if absent,
/// and what else, or other, `beside` holds; report.json lists the others. Errors: something cannot
/// be written (kIo); those of core::check_output.
core::Status write_report(const Report& report, const std::filesystem::path& folder,
                          const Texts& beside = {});

/// What an earlier diagnosis wrote into `folder` and nobody changed since: report.json, and of
/// those that it lists each that is still the same.
std::vector<std::filesystem::path> own_files(const std::filesystem::path& folder);

}  // namespace ravencal::diagnose
