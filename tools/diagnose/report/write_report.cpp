// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/write_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <system_error>
#include <utility>

#include "core/fnv1a.hpp"
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

namespace fs = std::filesystem;

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

/// Most of the text are series, a number a line: one column of indentation.
std::string text_of(const Json& json) {
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string hash_of(const std::string& text) { return fmt::format("{:016x}", core::fnv1a(text)); }

}  // namespace

std::string report_json(const Report& report) { return text_of(report_document(report)); }

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

core::Status write_report(const Report& report, const fs::path& folder, const Texts& beside) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    return core::io_error(fmt::format("{}: cannot be made: {}", folder.string(), error.message()));
  }
  Texts texts = beside;
  texts.try_emplace("report.html", report_html(report));
  texts.try_emplace("plant_improved.toml", improved_text(report));
  Json json = report_document(report);
  for (const auto& [name, text] : texts) json["files"][name] = hash_of(text);
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(folder / "report.json", text_of(json)));
  for (const auto& [name, text] : texts)
    RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(folder / name, text));
  return {};
}

std::vector<fs::path> own_files(const fs::path& folder) {
  const fs::path report = folder / "report.json";
  std::vector<fs::path> own;
  const auto text_in = [](const fs::path& path) -> std::optional<std::string> {
    std::error_code absent;
    if (!fs::is_regular_file(fs::symlink_status(path, absent))) return std::nullopt;
    auto text = core::read_whole_file(path);
    return text.ok() ? std::optional(std::move(*text)) : std::nullopt;
  };
  const Json json = Json::parse(text_in(report).value_or(""), nullptr, false);
  if (!json.is_object() || !json.contains("verdict") || !json.contains("files")) return {};
  own.push_back(report);
  for (const auto& [name, hash] : json["files"].items()) {
    const std::optional<std::string> text = text_in(folder / fs::path(name).filename());
    if (text && hash == hash_of(*text)) own.push_back(folder / fs::path(name).filename());
  }
  return own;
}

}  // namespace ravencal::diagnose
