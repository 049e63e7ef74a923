// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/write_report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "physics/plant_writer.hpp"

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

std::string improved_text(const Report& report) {
  std::string beyond;
  for (const NamedEffect& e : report.effects)
    if (e.beyond_plants) beyond += comment_for(e);
  std::string text = comment(report.improved.robot.name + ", improved by `ravencal diagnose`.") +
                     "\n" + physics::plant_text(report.improved);
  if (!beyond.empty()) text += "\n# Found, but beyond what `ravencal simulate` can run:\n" + beyond;
  return text;
}

}  // namespace ravencal::diagnose
