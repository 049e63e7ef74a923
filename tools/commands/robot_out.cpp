// SPDX-License-Identifier: Apache-2.0
#include "commands/robot_out.hpp"

#include "core/terminal.hpp"

namespace ravencal::commands {

void print_model(const physics::WrittenRobot& written, const std::filesystem::path& out) {
  core::say("{}: {} changes\n", out.string(), written.changed.size());
  for (const std::string& line : written.not_expressed) core::say("  not expressed: {}\n", line);
  if (written.callback.empty()) return;
  constexpr std::string_view kComment = "// ";
  core::say(
      "  {}: {}", physics::callback_path(out).string(),
      written.callback.substr(kComment.size(), written.callback.find('\n') + 1 - kComment.size()));
}

}  // namespace ravencal::commands
