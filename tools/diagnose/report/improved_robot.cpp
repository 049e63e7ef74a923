// SPDX-License-Identifier: Apache-2.0
#include "diagnose/report/improved_robot.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "core/whole_file.hpp"
#include "diagnose/report/write_report.hpp"

namespace ravencal::diagnose {
namespace {

namespace fs = std::filesystem;

std::optional<ImprovedRobot> improved_robot(Report& report, const fs::path& plant_file,
                                            const fs::path& folder) {
  if (!physics::is_robot_model(plant_file)) return std::nullopt;
  const fs::path path = folder / ("robot_improved" + plant_file.extension().string());
  const std::string name = path.filename().string();
  const auto note = [&report](const std::string& text) {
    report.verdict.text += " Note: " + text + ".";
  };
  auto written = physics::write_robot(report.improved, plant_file, path);
  if (!written.ok()) {
    note(fmt::format("{} was not written: {}", name, written.error().message));
    return std::nullopt;
  }
  const std::vector<std::string>& missing = written->not_expressed;
  note(fmt::format(
      "{} is {} with what was found{}", name, plant_file.filename().string(),
      missing.empty() ? "" : fmt::format("; it does not say {}", fmt::join(missing, "; "))));
  return ImprovedRobot{path, std::move(*written)};
}

}  // namespace

core::Result<std::optional<ImprovedRobot>> write_with_robot(Report& report,
                                                            const fs::path& plant_file,
                                                            const fs::path& folder) {
  std::optional<ImprovedRobot> robot = improved_robot(report, plant_file, folder);
  RAVENCAL_RETURN_IF_ERROR(write_report(report, folder));
  const bool beyond = std::any_of(report.effects.begin(), report.effects.end(),
                                  [](const NamedEffect& e) { return e.beyond_plants; });
  if (report.improved.hash != 0 && !beyond) {  // the given file's own
    RAVENCAL_ASSIGN_OR_RETURN(const std::string given, core::read_whole_file(plant_file));
    RAVENCAL_RETURN_IF_ERROR(core::write_whole_file(folder / "plant_improved.toml", given));
  }
  if (robot) RAVENCAL_RETURN_IF_ERROR(physics::save_robot(robot->written, robot->path));
  return robot;
}

}  // namespace ravencal::diagnose
