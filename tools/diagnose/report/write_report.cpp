// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/write_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "core/whole_file.hpp"
#include "diagnose/report/json.hpp"
#include "physics/plant_writer.hpp"
#include "report/document.hpp"

extern "C" {
// Names of the assembler (ravencal_embed_script). NOLINTNEXTLINE(readability-identifier-naming)
extern const char ravencal_diagnose_page[], ravencal_diagnose_page_end[];
}

namespace ravencal::diagnose {
namespace {

/// A comment has no control characters, and names are data.
std::string comment(std::string text) {
  const auto control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == '\x7f'; };
  std::replace_if(text.begin(), text.end(), control, ' ');
  return "# " + text + "\n";
}

std::string comment_for(const NamedEffect& e) {
  std::string text = fmt::format("  {} ({}): {}", e.joint, e.stage, e.id);
  for (const NamedParameter& p : e.parameters) {
    if (!p.name.starts_with("begin_"))
      text += fmt::format(", {} = {:.6g} {}", p.name, p.value, p.unit);
  }
  return comment(text);
}

}  // namespace

std::string report_json(const Report& report) {
  // Most of the text are series, a number a line: one column of indentation.
  return report_document(report).dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string report_html(const Report& report) {
  const std::string data =
      report_document(report).dump(-1, ' ', false, Json::error_handler_t::replace);
  return report::drawn_html("Diagnosis of the simulation", data, "report.json",
                            {ravencal_diagnose_page, ravencal_diagnose_page_end});
}

std::string improved_text(const Report& report) {
  std::string beyond;
  for (const NamedEffect& e : report.effects)
    if (e.beyond_plants) beyond += comment_for(e);
  std::string text = comment(report.improved.robot.name + ", improved by `ravencal diagnose`.") +
                     "\n" + physics::plant_text(report.improved);
  if (!beyond.empty()) text += "\n# Found, but beyond what `ravencal simulate` can run:\n" + beyond;
  return text;
}

core::Status write_report(const Report& report, const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return core::io_error(fmt::format("{}: cannot be made: {}", folder.string(), error.message()));
  }
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(folder / "report.json", report_json(report)));
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(folder / "report.html", report_html(report)));
  return core::write_whole_file(folder / "plant_improved.toml", improved_text(report));
}

}  // namespace ravencal::diagnose
