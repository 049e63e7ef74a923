// SPDX-License-Identifier: Apache-2.0
//
// A study's report: one HTML page that opens offline, of sections that the caller fills with tables
// and charts. It has the calibration report's style, scripts and rules (report.hpp).
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/result.hpp"

namespace ravencal::report {

/// A chart (study_charts.hpp) with what stands above and below it; text, not HTML.
struct StudyFigure {
  std::string heading;
  std::string caption;
  nlohmann::json spec;
};

struct StudySection {
  std::string id;                    ///< file-safe
  std::string title;                 ///< text
  std::string html;                  ///< e.g. study::to_html() of its tables; already escaped
  std::vector<StudyFigure> figures;  ///< below the tables
};

struct StudyPage {
  std::string title;
  std::string subtitle;
  std::string verdict;
  std::vector<StudySection> sections;
  std::vector<std::pair<std::string, std::string>> provenance;  ///< last section
  std::string reproduce;  ///< shell commands that make this page again
};

/// Writes the page to `path` whole. Errors: kIo.
core::Status write_study_html(const StudyPage& page, const std::filesystem::path& path);

}  // namespace ravencal::report
