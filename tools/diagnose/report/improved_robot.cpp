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

fs::path robot_path(const fs::path& plant_file, const fs::path& folder) {
  return folder / ("robot_improved" + plant_file.extension().string());
}

std::optional<ImprovedRobot> improved_robot(Report& report, const fs::path& plant_file,
                                            const fs::path& folder) {
  if (!physics::is_robot_model(plant_file)) return std::nullopt;
  const fs::path path = robot_path(plant_file, folder);
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

std::vector<fs::path> files_of(const fs::path& plant_file, const fs::path& folder) {
  std::vector<fs::path> files = {folder / "report.json", folder / "report.html",
                                 folder / "plant_improved.toml"};
  if (!physics::is_robot_model(plant_file)) return files;
  files.push_back(robot_path(plant_file, folder));
  files.push_back(physics::callback_path(files.back()));
  return files;
}

core::Result<std::optional<ImprovedRobot>> write_with_robot(Report& report,
                                                            const fs::path& plant_file,
                                                            const fs::path& folder) {
  std::optional<ImprovedRobot> robot = improved_robot(report, plant_file, folder);
  Texts texts;
  const bool beyond = std::any_of(report.effects.begin(), report.effects.end(),
                                  [](const NamedEffect& e) { return e.beyond_plants; });
  if (report.improved.hash != 0 && !beyond) {  // the given file's own
    RAVENCAL_ASSIGN_OR_RETURN(texts["plant_improved.toml"], core::read_whole_file(plant_file));
  }
  if (robot) {
    texts[robot->path.filename().string()] = robot->written.text;
    if (!robot->written.callback.empty())
      texts[physics::callback_path(robot->path).filename().string()] = robot->written.callback;
  }
  RAVENCAL_RETURN_IF_ERROR(write_report(report, folder, texts));
  return robot;
}

}  // namespace ravencal::diagnose
