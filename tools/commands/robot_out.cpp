// SPDX-License-Identifier: Apache-2.0
#include "commands/robot_out.hpp"

#include <fmt/format.h>

#include "core/whole_file.hpp"

namespace ravencal::commands {

core::Status save_robot(const physics::WrittenRobot& written, const std::filesystem::path& out) {
  RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(out, written.text));
  if (written.callback.empty()) return {};
  return core::write_whole_file(physics::callback_path(out), written.callback);
}

void print_model(const physics::WrittenRobot& written, const std::filesystem::path& out) {
  fmt::print("{}: {} changes\n", out.string(), written.changed.size());
  for (const std::string& line : written.not_expressed) fmt::print("  not expressed: {}\n", line);
  if (written.callback.empty()) return;
  constexpr std::string_view kComment = "// ";
  fmt::print(
      "  {}: {}", physics::callback_path(out).string(),
      written.callback.substr(kComment.size(), written.callback.find('\n') + 1 - kComment.size()));
}

}  // namespace ravencal::commands
